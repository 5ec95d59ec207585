#!/usr/bin/env bash
# methcomp's Passing-Bablok regression raises for half of all numbers of samples; for the others its slope is one place too high.
#
# Expected: documentation of passingbablok: Passing and Bablok (1983). The slope is the median of the N slopes of all pairs,
#   moved by K, the number of slopes below -1: the one at place (N + 1) / 2 + K, or the mean of those at N / 2 + K and one
#   further, counted from one.
# Seen: for odd N (10, 11, 14, 15, 18, 19 samples and so on) the place is (N + 1) / k + 2, where k is half the number of
#   slopes below 0: ZeroDivisionError for two methods that agree. For even N the places are counted from zero, so that both
#   are one too high: of the six slopes of four samples the fourth and fifth are taken, not the third and fourth. Two methods
#   with the same error then have a slope of 1.05, where the median gives 1.00.
# Hurts: comparisons with few samples find a proportional bias that is not there, or none can be made.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2 statsmodels==0.15.0 shapely==2.2.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps methcomp==1.0.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import itertools
import sys

import matplotlib.pyplot as plt
import numpy as np
from methcomp import passingbablok


def drawn(first, second):
    """Slope of the line that is drawn."""
    axis = passingbablok(first, second, line_reference=False, ax=plt.figure().gca())
    (x0, y0), (x1, y1) = axis.lines[0].get_xydata()
    return (y1 - y0) / (x1 - x0)


raised = []
for count in range(8, 20):
    first = np.arange(1.0, count + 1)
    try:
        drawn(first, first + 0.1 * np.cos(first))
    except ZeroDivisionError:
        raised.append(count)
print("ZeroDivisionError with", raised, "samples")

rng = np.random.default_rng(1)
bias, place = [], []
for _ in range(400):  # four samples of two methods with the same error
    true = np.array([1.0, 2.0, 3.0, 4.0])
    first, second = true + 0.1 * rng.normal(size=4), true + 0.1 * rng.normal(size=4)
    slopes = sorted((second[j] - second[i]) / (first[j] - first[i]) for i, j in itertools.combinations(range(4), 2))
    if slopes[0] < 0:
        continue
    slope = drawn(first, second)
    plt.close("all")
    bias.append((slope, np.median(slopes)))
    place.append(np.isclose(slope, np.sqrt(slopes[3] * slopes[4])))
mean = np.mean(bias, axis=0)
print(f"four samples, methods alike: mean slope {mean[0]:.3f}, of the median {mean[1]:.3f}; fourth and fifth of six: {np.mean(place):.0%}")
print("methcomp", meta.version("methcomp"))
still = raised == [10, 11, 14, 15, 18, 19] and all(place) and mean[0] > mean[1] + 0.03
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
