#!/usr/bin/env bash
# BioBSS's search for flat lines finds none in a signal that is one, nor one at the lowest or highest value.
#
# Expected: docstring of detect_flatline_segments: the boundaries of segments of at least min_duration whose changes are not above
#   change_threshold. A constant signal is one such segment.
# Seen: samples equal to the signal's maximum or minimum never count. A constant signal is without a flat line, and so is a sensor off for
#   half of the time, if what it gives then is 0 and this is its lowest value. A flat line in between is found.
# Hurts: a check of signal quality passes the recording without electrodes, which is the worst. Clipping is a check of its own, which
#   needs limits of amplitude, and finds nothing here either if these are the amplifier's.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps biobss==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import importlib.util
import types
from pathlib import Path

root = Path(importlib.util.find_spec("biobss").origin).parent
for name in ("biobss", "biobss.sqatools", "biobss.ecgtools"):  # without the plots and detectors that the packages import
    module = types.ModuleType(name)
    module.__path__ = [str(root.joinpath(*name.split(".")[1:]))]
    sys.modules[name] = module

import numpy as np
from biobss.ecgtools.ecg_sqa import sqa_ecg

time = np.arange(0, 10, 0.01)
wave = 1 + np.sin(2 * np.pi * 1.2 * time) ** 2
off = np.where(time < 5, wave, 0.0)
middle = np.where(time < 5, wave, 1.5)
rail = np.where(time < 5, wave, 3.0)
seen = {}
for name, signal in {"constant": np.zeros(1000), "off after 5 s, at 0": off, "off after 5 s, at 3": rail, "off after 5 s, at 1.5": middle}.items():
    found = sqa_ecg(signal, 100, ["flatline", "clipping"], min_duration=100, change_threshold=1e-6, threshold_pos=5)
    flat = np.abs(np.diff(signal[500:])) <= 1e-6
    seen[name] = found["Flatline segments"], int(flat.sum())
    print(f"{name}: flat lines {[(int(a), int(b)) for a, b in found['Flatline segments']]}, clipped {found['Clipped segments']}, without change in the second half {flat.sum()} steps of {len(flat)}")
print("biobss", meta.version("biobss"))
still = all(steps == 499 for _, steps in seen.values()) and [lines for lines, _ in seen.values()] == [[], [], [], [(500, 999)]]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
