#!/usr/bin/env bash
# pymse cuts the averages of a series of integers: the same numbers have another multiscale entropy as floats.
#
# Expected: its description: multiscale entropy (Costa et al., 2002): a series is averaged over windows of the scale, and the
#   sample entropy of the averages is taken. Whether 800 ms are stored as 800 or 800.0 does not matter.
# Seen: averages are put into a copy of the data, so of integers they are integers, cut after each division. The entropy is 1.44
#   for 1.26 at a scale of 2, 0.93 for 1.04 at one of 10.
# Hurts: RR intervals in ms and raw values of an EMG or EEG recorder are integers; the entropy's course over the scales, which
#   is what one looks at, is that of a coarser recorder.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check setuptools==80.9.0 numpy==2.4.6 pymse==0.2.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pymse.pymse import PyMSE, mse

rng = np.random.default_rng(2)
intervals = np.round(800 + 1.6 * rng.normal(size=400).cumsum() + rng.normal(0, 3, 400)).astype(int)
scales = [1, 2, 5, 10]
whole, floats = (mse(series, scale=scales).ravel() for series in (intervals, intervals.astype(float)))
for scale, cut, right in zip(scales, whole, floats):
    print(f"scale {scale}: {cut:.3f}, of the same numbers as floats {right:.3f}")
averages = PyMSE(np.array([800, 801, 803, 804])).coarse_grain(2)[:2], PyMSE(np.array([800.0, 801, 803, 804])).coarse_grain(2)[:2]
print(f"averages of 800 801 and 803 804: {averages[0]}, as floats {averages[1]}")
print("pymse", meta.version("pymse"))
still = whole[0] == floats[0] and bool((np.abs(whole - floats)[1:] > 0.05).all())
still &= averages[0].tolist() == [800, 803] and averages[1].tolist() == [800.5, 803.5]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
