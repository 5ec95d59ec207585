#!/usr/bin/env bash
# BioBSS's check of the rise time's variation is one of the peaks' heights: an offset turns it over.
#
# Expected: docstring of check_morph: rule 1 is about the systolic phase duration (rise time), 0.08 to 0.49 s; rule 4 about the variation of
#   the pulse wave's duration and of SP, up to 300 %. Rule 5 is about the variation of amplitude.
# Seen: for rule 4 the peaks' heights are taken in place of the rise times, as the signal has them, without their troughs. Rise times of
#   0.08 to 0.48 s, a variation of 500 %, pass. Equal pulses on a slow baseline fail, and pass with 10 added to the signal.
# Hurts: pulse waves are judged by their baseline: after a high-pass the heights are around small numbers, and good segments are dropped.
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
for name in ("biobss", "biobss.sqatools"):  # without the plots and detectors that the packages import
    module = types.ModuleType(name)
    module.__path__ = [str(root.joinpath(*name.split(".")[1:]))]
    sys.modules[name] = module

import numpy as np
from biobss.sqatools.signal_quality import check_morph

RATE = 100
troughs = np.arange(0, 11) * 100


def pulses(rises, heights):
    return np.interp(np.arange(1001), np.sort(np.concatenate([troughs, troughs[:-1] + rises])), np.append(np.stack([np.zeros(10), heights], 1).ravel(), 0)), troughs[:-1] + rises


def rule_4(signal, peaks):
    rises = (peaks - troughs[:-1]) / RATE
    variation = (rises.max() - rises.min()) / rises.min() * 100
    return check_morph(signal, peaks, troughs, RATE)["Rule 4"], variation


seen = {}
equal, equal_peaks = pulses(np.full(10, 20), np.full(10, 1.0))
wander = 0.8 * np.sin(2 * np.pi * np.arange(1001) / 1000)
uneven, uneven_peaks = pulses(np.array([8, 48] * 5), np.full(10, 1.0))
for name, signal, peaks in (("equal pulses", equal, equal_peaks), ("on a slow baseline", equal + wander, equal_peaks), ("that and 10", equal + wander + 10, equal_peaks), ("rise times of 0.08 and 0.48 s", uneven, uneven_peaks)):
    passed, variation = seen[name] = rule_4(signal, peaks)
    print(f"{name}: rule 4 {passed}, the rise times vary by {variation:.0f} %")
print("biobss", meta.version("biobss"))
still = [bool(passed) for passed, _ in seen.values()] == [True, False, True, True] and [round(variation) for _, variation in seen.values()] == [0, 0, 0, 500]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
