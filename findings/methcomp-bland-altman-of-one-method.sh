#!/usr/bin/env bash
# methcomp's Bland-Altman plot has the first method on its axis "Mean of methods", and per cent of the first method.
#
# Expected: Bland and Altman (1986): the difference against the mean of both methods, whose axis methcomp names "Mean of methods";
#   in per cent the difference is divided by that mean.
# Seen: the mean is that of the first method and the first method. With 50 and 100 the point is at 50, not 75, and the difference is
#   -100 %, not -67 %; with the methods exchanged it is at 100 and +50 %. Two methods with the same error, and no bias that
#   depends on the size, have differences that rise with it (correlation 0.33 for -0.04).
# Hurts: a bias that grows with the value is seen where there is none: the very error that the mean is there to avoid.
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
from methcomp import blandaltman


def points(first, second, kind):
    """What is drawn: places and differences."""
    axis = plt.figure().gca()
    blandaltman(first, second, diff=kind, CI=None, ax=axis)
    return axis.get_xlabel(), np.asarray(axis.collections[0].get_offsets())


seen = []
for first, second in ((50.0, 100.0), (100.0, 50.0)):
    label, drawn = points([first, 10.0], [second, 10.0], "percentage")
    seen.append(drawn[0].round(1).tolist())
    print(f"methods {first:g} and {second:g}: '{label}' {drawn[0, 0]:g}, difference {drawn[0, 1]:.0f} %")
rng = np.random.default_rng(1)
true = rng.normal(10, 1, 5000)
first, second = true + 0.6 * rng.normal(size=5000), true + 0.6 * rng.normal(size=5000)
_, drawn = points(first, second, "absolute")
slope = np.corrcoef(drawn.T)[0, 1]
right = np.corrcoef((first + second) / 2, first - second)[0, 1]
print(f"methods alike: correlation of difference and place {slope:.2f}, with the mean of both {right:.2f}")
print("methcomp", meta.version("methcomp"))
still = seen == [[50.0, -100.0], [100.0, 50.0]] and slope > 0.3 and abs(right) < 0.05
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
