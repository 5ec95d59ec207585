#!/usr/bin/env bash
# resurfemg's detector of breaths adds the percentiles that it should subtract: on a noise floor it finds no breath.
#
# Expected: docstring of detect_emg_breaths: a peak's prominence is relative to "the 75th - 50th percentile" of the envelope
#   above the baseline; without a baseline zero is taken. A constant noise floor of the envelope changes neither.
# Seen: the sum of both percentiles is taken, so that the floor raises the limit: 15 breaths of 3 uV are found on a floor of 2 uV, none
#   on one of 3 uV or more, although their shape is the same and there is no noise that varies.
# Hurts: weak breaths (as in patients, whose EMG is a few microvolts on a similar floor) are reported as absent.
# (The packages' own __init__ files, which import MNE and neurokit2, are left out.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps resurfemg==1.1.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

import numpy as np
from scipy.signal import find_peaks

root = meta.distribution("resurfemg").locate_file("resurfemg")
for name in ("resurfemg", "resurfemg.postprocessing", "resurfemg.helper_functions"):
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__path__ = [str(root.joinpath(*name.split(".")[1:]))]
from resurfemg.postprocessing.event_detection import detect_emg_breaths

times = np.arange(60_000) / 1000
breaths = 3 * np.maximum(0, np.sin(2 * np.pi * times / 4)) ** 2
seen = {}
for floor in (0, 1, 2, 3, 5):
    envelope = floor + breaths
    upper, middle = np.percentile(envelope, [75, 50])
    documented = find_peaks(envelope, height=0, prominence=0.5 * (upper - middle), width=1)[0]
    seen[floor] = (len(documented), len(detect_emg_breaths(envelope)))
    print(f"15 breaths of 3 uV on a floor of {floor} uV: by the docstring {seen[floor][0]}, resurfemg {seen[floor][1]}")
print("resurfemg", meta.version("resurfemg"))
still = seen == {0: (15, 15), 1: (15, 15), 2: (15, 15), 3: (15, 0), 5: (15, 0)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
