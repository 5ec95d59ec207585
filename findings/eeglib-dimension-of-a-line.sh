#!/usr/bin/env bash
# eeglib's Higuchi dimension of a straight line is 1.13 to 1.17, that of noise above 2, by a miscount of the pieces.
#
# Expected: docstring of HFD: the Higuchi fractal dimension (Higuchi, 1988): between 1 and 2. The length of each sub-series is
#   the sum of its differences, divided by their number; of a straight line it is the same for all, so the dimension is exactly
#   1 for any window.
# Seen: the last difference of most sub-series is left out, and the divisor counts one too many of them. The longer the delay,
#   the fewer there are, so long delays (by default up to a quarter of the window) get too short curves: the steeper slope is a
#   higher dimension, and it depends on the window.
# Hurts: values of windows of different lengths, or of other software; 2.1 cannot be a dimension of a curve in a plane.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==2.3.3 scikit-learn==1.9.1 numba==0.68.1 pyedflib==0.1.42 fastdtw==0.3.4 progressbar2==4.6.0 eeglib==0.4.1.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from eeglib.features import HFD


def higuchi(series, largest):
    count, lengths = len(series), []
    for k in range(2, largest + 1):
        pieces = [series[start::k] for start in range(k)]
        lengths.append(np.mean([np.abs(np.diff(piece)).sum() * (count - 1) / ((len(piece) - 1) * k) / k for piece in pieces]))
    return -np.polyfit(np.log(np.arange(2, largest + 1)), np.log(lengths), 1)[0]


rng = np.random.default_rng(1)
still = True
for size in (64, 128, 256):
    line, noise = np.arange(float(size)), rng.normal(size=(10, size))
    found = HFD(line), np.mean([HFD(series) for series in noise])
    right = higuchi(line, size // 4), np.mean([higuchi(series, size // 4) for series in noise])
    print(f"window of {size}: line {found[0]:.3f}, by Higuchi's formula {right[0]:.3f}; noise, mean of 10, {found[1]:.3f}, {right[1]:.3f}")
    still &= bool(abs(right[0] - 1) < 1e-6 and found[0] > 1.1 and found[1] > 2.05 and abs(right[1] - 2) < 0.06)
print("eeglib", meta.version("eeglib"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
