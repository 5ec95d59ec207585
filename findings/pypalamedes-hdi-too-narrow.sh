#!/usr/bin/env bash
# pypalamedes's highest-density intervals hold less than they say: of "95 %" beside a narrow posterior 83 %.
#
# Expected: docstring of pypalamedes.hdi: finds the high-density interval of a probability mass function or of a density on
#   discrete values; width is the width of the interval reported. On a grid it is the smallest set that holds
#   at least that much.
# Seen: the value with which the interval would reach the width is left out. The interval always holds less, the less
#   the coarser the grid beside the posterior, and nothing tells how much.
# Hurts: credible intervals of thresholds from the adaptive method of the same package, whose posterior is on such a grid: too
#   narrow, most of all after many trials, when the posterior is narrow. The true threshold is outside too often.
# (Its dependencies are named here, since it also asks for pathlib and importlib of PyPI, which are older than Python's own.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pypalamedes==1.11.13
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pypalamedes

grid = np.linspace(-2, 2, 81)  # the package's default grid of thresholds, in steps of 0.05
seen = {}
for sd in (0.03, 0.05, 0.1, 0.4):
    mass = np.exp(-0.5 * (grid / sd) ** 2)
    mass /= mass.sum()
    (low, high), *more = np.asarray(pypalamedes.hdi(grid, mass, 0.95)).tolist()
    inside = (grid >= low - 1e-9) & (grid <= high + 1e-9)
    seen[sd] = (float(mass[inside].sum()), len(more))
    print(f"posterior with an SD of {sd}: 95 % interval {low:.2f} to {high:.2f}, holds {100 * seen[sd][0]:.1f} %")
print("pypalamedes", meta.version("pypalamedes"), "numpy", meta.version("numpy"))
still = all(held < 0.95 and not more for held, more in seen.values()) and seen[0.03][0] < 0.85
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
