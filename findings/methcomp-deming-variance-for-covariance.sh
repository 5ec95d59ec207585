#!/usr/bin/env bash
# methcomp's Deming regression uses the variance of the second method for the covariance: a slope of 2 is 1.44, of -1 is 1.
#
# Expected: documentation of deming: method comparison by Deming regression (Koopmans 1937, Deming 1943), where the slope is
#   (syy - l sxx + sqrt((syy - l sxx)^2 + 4 l sxy^2)) / (2 sxy). For points on a line it is that line; each bootstrapped
#   estimate has an interval of its own.
# Seen: both sxy are the variance of the second method. On the line 1 + 2 x the slope is 1.44 and the intercept 4.06; on
#   1 + x / 2 it is 0.30; on 11 - x, where the methods are opposed, it is +1. Only on a slope of 1 it is right. The
#   line's band is made of the intercept's interval alone: the slope, whose interval is the intercept's, has none.
# Hurts: proportional bias between two methods is understated on one side and overstated on the other; methods that do
#   not agree at all have a slope near their ratio of SDs.
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
import sys

import matplotlib.pyplot as plt
import numpy as np
from methcomp import deming


def line(first, second):
    """Intercept and slope of the line that is drawn."""
    axis = deming(first, second, bootstrap=None, line_reference=False, ax=plt.figure().gca())
    (x0, y0), (x1, y1) = axis.lines[0].get_xydata()
    slope = (y1 - y0) / (x1 - x0)
    return y0 - slope * x0, slope


first = np.linspace(1, 10, 40)
seen = {}
for slope in (2.0, 0.5, 1.0, -1.0):
    start = 1.0 if slope > 0 else 11.0
    seen[slope] = [round(float(one), 2) for one in line(first, start + slope * first)]
    print(f"second = {start:g} + {slope:g} first: drawn as {seen[slope][0]} + {seen[slope][1]} first")
noise = np.random.default_rng(1).normal(size=200)
unrelated = line(np.linspace(1, 10, 200), 5 + 0.5 * noise)[1]
print(f"second unrelated to first: slope {unrelated:.2f}")
print("methcomp", meta.version("methcomp"))
still = [seen[slope][1] for slope in seen] == [1.44, 0.3, 1.0, 1.0] and seen[2.0][0] > 3
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
