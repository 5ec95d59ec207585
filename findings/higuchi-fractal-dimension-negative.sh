#!/usr/bin/env bash
# higuchi-fractal's dimension of white noise is -1, of a line 0: two terms of Higuchi's formula are missing.
#
# Expected: docstring: the Higuchi fractal dimension of a series: D where the curve's length goes with k to the power of -D
#   (Higuchi, 1988): 1 for a line, 1.5 for a random walk, 2 for white noise. k_max is the largest delay.
# Seen: the length is not divided by k the second time, and the slope is given with its sign: the result is 1 - D. The largest
#   delay is not used.
# Hurts: the dimension of EEG and EMG; an increase is a decrease, groups come out in the reversed order, and values do not
#   compare with any other software.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 higuchi-fractal==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from higuchi_fractal.higuchi_fractal import higuchi_fd


def higuchi(series, k_max):
    count, lengths = len(series), []
    for k in range(1, k_max + 1):
        pieces = [series[start::k] for start in range(k)]
        lengths.append(np.mean([np.abs(np.diff(piece)).sum() * (count - 1) / ((len(piece) - 1) * k) / k for piece in pieces]))
    return -np.polyfit(np.log(np.arange(1, k_max + 1)), np.log(lengths), 1)[0]


rng = np.random.default_rng(1)
still = True
for case, dimension, series in (
    ("line", 1, np.arange(2000.0)),
    ("random walk", 1.5, rng.normal(size=2000).cumsum()),
    ("white noise", 2, rng.normal(size=2000)),
):
    found, right = higuchi_fd(series, 20), higuchi(series, 20)
    print(f"{case}: {found:.3f}, by Higuchi's formula {right:.3f}, known {dimension}")
    still &= bool(abs(right - dimension) < 0.03 and abs(found - (1 - dimension)) < 0.03)
print("higuchi-fractal", meta.version("higuchi-fractal"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
