#!/usr/bin/env bash
# bland-altman and pyCompare draw limits of agreement from the population's standard deviation: with six pairs they are a
#   tenth too narrow.
#
# Expected: Bland and Altman (1986): limits of agreement are the mean difference plus and minus 1.96 standard deviations of
#   the differences, the sample's (n - 1), as in other programs.
# Seen: numpy's default, n, is taken. Between sessions of six persons the limits are 9 % too narrow, of three 18 %.
# Hurts: agreement of two methods or two days is overstated in small samples, and differs from what R, MedCalc or pingouin
#   give for the same data. pyCompare cites that definition, and uses n - 1 for its confidence intervals.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    bland-altman==0.1.4 pyCompare==1.5.4 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import matplotlib.pyplot as plt
import numpy as np
from bland_altman import bland_altman_plot
from pyCompare import blandAltman

rng = np.random.default_rng(1)
seen = {}
for pairs in (3, 6, 20):
    first = rng.normal(50, 5, pairs)
    second = first + rng.normal(1, 2, pairs)
    difference = first - second
    half = 1.96 * difference.std(ddof=1)
    print(f"{pairs} pairs: limits by the definition {difference.mean() - half:.2f} to {difference.mean() + half:.2f}")
    for name, draw in (("bland-altman", bland_altman_plot), ("pyCompare", lambda one, two: blandAltman(one, two, confidenceInterval=None))):
        draw(first, second)
        lines = [line.get_ydata() for axes in plt.gcf().axes for line in axes.lines]
        heights = sorted({round(float(line[0]), 9) for line in lines if len(set(line)) == 1})
        plt.close("all")
        seen[pairs, name] = (heights[-1] - heights[0]) / (2 * half)
        print(f"    {name}: {heights[0]:.2f} to {heights[-1]:.2f}")
print("bland-altman", meta.version("bland-altman"), "pyCompare", meta.version("pyCompare"))
still = all(abs(ratio - np.sqrt((pairs - 1) / pairs)) < 1e-6 for (pairs, _), ratio in seen.items())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
