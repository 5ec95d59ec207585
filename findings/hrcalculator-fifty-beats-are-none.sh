#!/usr/bin/env bash
# HRCalculator has no heart rate for intervals of exactly 400 or 1200 ms, and leaves the last interval out.
#
# Expected: heartrate_calculation(peaks, fs): 60000 ms divided by each interval between peaks; a comment says that intervals out of
#   400 to 1200 ms take the mean of the last rates, and that the last branch is there to get around a division by zero.
# Seen: 400 and 1200 ms are in none of the ranges: "err" is printed and they are dropped; a steady pulse of 50 or of 150 a minute
#   has nan. The loop over the peaks ends one early: of the intervals 800, 800, 1000 the last is never counted.
# Hurts: at the usual 50 or 100 samples a second these lengths are common: slow pulses look faster than they are.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation HRCalculator==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import contextlib
import importlib.metadata as meta
import io
import math
import sys

import numpy as np
from HRCalculator import PPI_calculation, heartrate_calculation

fs, seen = 50, {}
for case, intervals in (
    ("steady 50 a minute", [1200] * 20),
    ("steady 52 a minute", [1160] * 20),
    ("steady 150 a minute", [400] * 20),
    ("1160, 1200, 1180 in turn", [1160, 1200, 1180] * 7),
):
    peaks = [int(one) for one in np.cumsum([0, *intervals]) * fs // 1000]
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        seen[case] = float(heartrate_calculation(peaks, fs)[0])
    errors = printed.getvalue().count("err")
    print(f"{case}: {seen[case]:.1f} for {60000 / np.mean(intervals):.1f}, {errors} of {len(intervals)} intervals dropped")
kept = [round(float(one)) for one in PPI_calculation([0, 40, 80, 130], fs)]
print("intervals 800, 800, 1000 ms:", kept)
print("HRCalculator", meta.version("HRCalculator"))
still = math.isnan(seen["steady 50 a minute"]) and math.isnan(seen["steady 150 a minute"]) and kept == [800, 800]
still &= round(seen["steady 52 a minute"], 1) == 51.7
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
