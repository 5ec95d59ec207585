#!/usr/bin/env bash
# featureOfPPGsignal's five minutes are 300 samples: at 100 Hz the SDNN index is of three seconds, and SDANN is of what SDNNi should be.
#
# Expected: docstrings of calculateSDNNi and calculateSDANN: the mean of the standard deviations of the intervals, and the standard deviation
#   of their means, each over segments of 5 minutes; duration is the longest segment in seconds, 300 by default, fs the sampling rate. Peaks
#   are in samples: differences of them are divided by fs.
# Seen: duration is compared with the peaks' positions without fs. A wave of 100 s, 71 ms within segments and 0 between them,
#   has an SDNN index of 3 ms and an SDANN of 71 ms at 100 Hz, and none at 250 Hz. With peaks in seconds, and 1 for fs, both are right.
# Hurts: both are used for long recordings: variation within and between segments change places, by the sampling rate.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check setuptools==80.9.0 wheel==0.45.1 numpy==1.26.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation featureOfPPGsignal==0.0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import importlib.util
import types

sys.path[:0] = importlib.util.find_spec("featureOfPPGsignal").submodule_search_locations  # the modules import each other by these names
sys.modules["geometric_features"] = types.ModuleType("geometric_features")  # the search for peaks, which is not called here

import numpy as np
from hrv_features import calculateSDANN, calculateSDNNi

seconds = [0.0]
while seconds[-1] < 1198:
    seconds.append(seconds[-1] + 0.8 + 0.1 * np.sin(2 * np.pi * seconds[-1] / 100))
seconds = np.array(seconds)
intervals = np.diff(seconds) * 1000
segment = (seconds[1:] // 300).astype(int)
right = [float(np.mean([intervals[segment == k].std() for k in range(4)])), float(np.std([intervals[segment == k].mean() for k in range(4)]))]
print(f"by the definition: SDNN index {right[0]:.1f} ms, SDANN {right[1]:.1f} ms")
seen = {}
for fs in (1, 50, 100, 250):
    peaks = list(seconds if fs == 1 else np.round(seconds * fs))
    seen[fs] = [float(calculateSDNNi(peaks, fs)), float(calculateSDANN(peaks, fs))]
    print(f"at {fs} Hz: SDNN index {seen[fs][0]:.1f} ms, SDANN {seen[fs][1]:.1f} ms")
print("featureOfPPGsignal", meta.version("featureOfPPGsignal"))
still = max(abs(a - b) for a, b in zip(seen[1], right)) < 1 and seen[100][0] < 5 and seen[50][0] < 12 and min(seen[50][1], seen[100][1]) > 70 and right[0] > 70 and right[1] < 0.1 and np.isnan(seen[250]).all()
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
