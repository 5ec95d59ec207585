#!/usr/bin/env bash
# dcca does not sum the series before it removes trends: the detrended correlation at 100 samples is 0.16 for 0.72.
#
# Expected: README: detrended cross-correlation analysis after Podobnik and Stanley (2008) and Shen (2015): the series' deviations from
#   their mean are summed up first, then windows of the sums are freed of their trends. integrate_series "returns the integrated
#   series".
# Seen: integrate_series subtracts the mean and sums nothing. Two series that share a slow part below noise of twice its size have
#   0.05, 0.09, 0.16 and 0.20 at scales of 10, 30, 100 and 300 samples, for 0.14, 0.47, 0.72 and 0.85 by the definition.
# Hurts: what the method is for: that two signals go together on slow scales, such as tremor, sway or excitability, is not found.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation dcca==0.3.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from dcca import detrended_correlation, integrate_series


def by_definition(x, y, scale, summed):
    """Correlation of what is left of all windows without their lines."""
    left = []
    times = np.arange(scale + 1) - scale / 2
    for series in (x, y):
        series = series - series.mean()
        windows = np.lib.stride_tricks.sliding_window_view(np.cumsum(series) if summed else series, scale + 1)
        windows = windows - windows.mean(axis=1, keepdims=True)
        left.append(windows - np.outer(windows @ times / (times @ times), times))
    return float((left[0] * left[1]).sum() / np.sqrt((left[0] ** 2).sum() * (left[1] ** 2).sum()))


rng = np.random.default_rng(1)
slow = np.zeros(2000)
for index, step in enumerate(rng.normal(size=1999), start=1):
    slow[index] = 0.9 * slow[index - 1] + np.sqrt(0.19) * step
x, y = slow + 2 * rng.normal(size=2000), slow + 2 * rng.normal(size=2000)
print("the 'integrated' series of 1, 2 and 6:", integrate_series(np.array([1.0, 2.0, 6.0]), 3.0))
seen = {}
for scale in (10, 30, 100, 300):
    seen[scale] = float(detrended_correlation(x, y, scale, 0)), by_definition(x, y, scale, True), by_definition(x, y, scale, False)
    print(f"{scale} samples: {seen[scale][0]:.3f}, by the definition {seen[scale][1]:.3f}, without the sums {seen[scale][2]:.3f}")
print("dcca", meta.version("dcca"))
still = all(abs(one[0] - one[2]) < 0.01 for one in seen.values()) and seen[100][0] < 0.2 and seen[100][1] > 0.7
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
