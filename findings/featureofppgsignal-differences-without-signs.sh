#!/usr/bin/env bash
# featureOfPPGsignal's standard deviation of differences is one of their sizes: long and short intervals in turn have none.
#
# Expected: docstring of calculateSDSD: the standard deviation of the differences (SDSD: of those between successive intervals, with their
#   signs, as in the guidelines of 1996). It is about the RMSSD where the mean difference is about 0, as it nearly always is.
# Seen: the differences lose their signs before. Intervals of 0.7 and 0.9 s in turn have differences of 200 and -200 ms, an SDSD of 200 ms;
#   the value is 0. Peaks are found as they are.
# Hurts: SDSD is beat-to-beat variation: this is the variation of that, which is small for an alternation, however large.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check setuptools==80.9.0 wheel==0.45.1 numpy==1.26.4 scipy==1.13.1 \
    pandas==2.2.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation featureOfPPGsignal==0.0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import importlib.util
import types

sys.path[:0] = importlib.util.find_spec("featureOfPPGsignal").submodule_search_locations  # the modules import each other by these names
sys.modules["matplotlib"] = types.ModuleType("matplotlib")  # nothing is drawn
sys.modules["matplotlib"].pyplot = None

import numpy as np
from geometric_features import find_systolic_peaks
from hrv_features import calculateRMSSD, calculateSDSD

time = np.arange(0, 10, 0.01)
seen = {}
for name, intervals in {"0.7 and 0.9 s in turn": [0.7, 0.9] * 8, "0.75 and 0.85 s in turn": [0.75, 0.85] * 8, "0.8 s": [0.8] * 16}.items():
    beats = -1.2 + np.cumsum(intervals)
    wave = sum(np.exp(-((time - beat) ** 2) / 0.02) for beat in beats)
    peaks = find_systolic_peaks(list(wave))[0]
    differences = np.diff(np.diff(peaks)) * 10.0
    seen[name] = float(calculateSDSD(list(wave))), float(differences.std()), float(calculateRMSSD(list(peaks), 100))
    print(f"{name}: intervals {np.diff(peaks) * 10} ms, SDSD {seen[name][0]:.1f} ms, by the definition {seen[name][1]:.1f}, RMSSD {seen[name][2]:.1f}")
print("featureOfPPGsignal", meta.version("featureOfPPGsignal"))
still = all(value < 1e-6 for value, _, _ in seen.values()) and [round(right) for _, right, _ in seen.values()] == [200, 100, 0] and [round(rmssd) for _, _, rmssd in seen.values()] == [200, 100, 0]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
