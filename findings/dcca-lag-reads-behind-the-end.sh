#!/usr/bin/env bash
# dcca reads behind the end of a series at a lag: the correlation depends on what lies there, 0.76 is 0.33 or 0.
#
# Expected: docstring of detrended_correlation: the detrended correlation of x with y moved by the lag, between -1 and 1, after Shen
#   (2015). Two arrays of 500 values have one result, whatever else is in memory.
# Seen: for the two variances the series are cut at the front by the lag, but windows are counted by their old length, so that the
#   last ones lie behind the end. If the arrays are the first 500 samples of longer recordings the samples that follow count: with
#   noise ten times as large behind them 0.76 is 0.33, with noise 1000 times as large it is 0. Other arrays read other memory.
# Hurts: lags between EMG, EEG or force in parts of recordings: the lag with the largest correlation is that with a quiet end.
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
from dcca import detrended_correlation


def by_definition(x, y, scale, lag):
    """The same windows, on the values that both series have."""
    first, second, times = x[: x.size - lag], y[lag:], np.arange(scale + 1)
    sums = np.zeros(3)
    for start in range(first.size - scale):
        u, v = (one[start : start + scale + 1] for one in (first, second))
        u, v = (one - np.polyval(np.polyfit(times, one, 1), times) for one in (u, v))
        sums += u @ v, u @ u, v @ v
    return sums[0] / np.sqrt(sums[1] * sums[2])


rng = np.random.default_rng(1)
common = rng.normal(size=520)
x = common[20:] + 0.5 * rng.normal(size=500)
y = common[:500] + 0.5 * rng.normal(size=500)  # 20 samples later than x
seen = {}
for size in (0, 1, 10, 1000):
    longer = [np.concatenate([one, size * rng.normal(size=300)]) for one in (x, y)]
    parts = [one[:500] for one in longer]  # the same 500 values each time
    seen[size] = [float(detrended_correlation(*parts, time_scale=30, time_lag=lag)) for lag in (0, 20)]
    print(f"what follows is {size} times as large: without a lag {seen[size][0]:.3f}, at 20 samples {seen[size][1]:.3f}")
print(f"by the definition: {by_definition(x, y, 30, 0):.3f} and {by_definition(x, y, 30, 20):.3f}")
print("dcca", meta.version("dcca"))
still = np.ptp([one[0] for one in seen.values()]) < 1e-9 and seen[0][1] > 0.7 and 0.3 < seen[10][1] < 0.5 and seen[1000][1] < 0.01
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
