#!/usr/bin/env bash
# lubdub leaves the last interval out of the SDNN, and divides RMSSD's sum by one difference too many.
#
# Expected: docstring of sdnn: the standard deviation of NN intervals; of rmssd: the root of the (mean of the) squares of the
#   successive differences (Task Force of the ESC and NASPE, 1996: "the square root of the mean of the sum of the squares of
#   differences between adjacent NN intervals"). Of n intervals there are n - 1 differences.
# Seen: the loop for the SDNN stops one before the end, with the mean and the divisor of all: 800, 800, 1000 ms have 67 for 115
#   ms. RMSSD divides by n: two intervals 100 ms apart have 71; in the windows of 12 of the rolling curve it is 4 % too small.
# Hurts: short windows, as the rolling HRV for calm and stress here; one long interval changes the SDNN or not by its place.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check setuptools==80.9.0 lubdub==0.0.2.6.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import random
import statistics
import sys

from lubdub.calc import rmssd, sdnn

generator = random.Random(1)
still = True
for case, values in (
    ("last is longer", [800, 800, 1000]),
    ("first is longer", [1000, 800, 800]),
    ("two", [800, 900]),
    ("a window of 12", [800 + generator.gauss(0, 30) for _ in range(12)]),
):
    squares = [(a - b) ** 2 for a, b in zip(values, values[1:])]
    right = statistics.stdev(values), statistics.mean(squares) ** 0.5
    found = sdnn(values), rmssd(values)
    print(f"{case}: SDNN {found[0]:.1f} for {right[0]:.1f} ms, RMSSD {found[1]:.1f} for {right[1]:.1f} ms")
    count, mean = len(values), statistics.mean(values)
    without = (sum((value - mean) ** 2 for value in values[:-1]) / (count - 1)) ** 0.5
    still &= abs(found[0] - without) < 1e-9 and abs(found[1] - right[1] * ((count - 1) / count) ** 0.5) < 1e-9
print("lubdub", meta.version("lubdub"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
