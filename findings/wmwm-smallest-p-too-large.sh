#!/usr/bin/env bash
# wmwm's smallest possible p is not the smallest: it says at least 0.70 where one way to fill in four missing values gives 0.016.
#
# Expected: docstring of wmwm_test: "bounds_pvalue: bounds of the p-value of the Wilcoxon-Mann-Whitney test" over all values that the missing
#   ones could have had (Zeng, Adams and Bodenham 2024).
# Seen: for two-sided exact tests the tail for the largest possible U is chosen by the smallest one. Where the smallest is below half of all
#   pairs and the largest above, its p is taken from the wrong tail and is 1, so that the lower bound is that of the smallest U alone.
# Hurts: who reads from the bounds whether the missing persons could matter: "no p below 0.70 is possible" where 0.016 is. By the order of the
#   two groups the bound is another one.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps wmwm==0.0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from scipy.stats import mannwhitneyu
from wmwm import wmwm_test

first = np.array([4.1, 5.2, 6.3, 7.7, 8.8, 9.9] + [np.nan] * 4)
second = np.array([1.0, 2.5, 3.7, 5.9, 6.1, 7.1, 8.1, 5.5])
possible = []
for above in range(5):  # so many of the missing values above all others, the rest below
    filled = first.copy()
    filled[6:] = [100 + place if place < above else -100 - place for place in range(4)]
    possible.append(float(mannwhitneyu(filled, second, method="exact").pvalue))
bounds = wmwm_test(first, second, ties=False)["bounds_pvalue"]
turned = wmwm_test(second, first, ties=False)["bounds_pvalue"]
print("p with none to all of the four missing values above the others:", ", ".join(f"{p:.3f}" for p in possible))
print(f"bounds of p: {bounds[0]:.3f} to {bounds[1]:.3f}; with the groups exchanged {turned[0]:.3f} to {turned[1]:.3f}")
print("wmwm", meta.version("wmwm"))
still = min(possible) < 0.02 and bounds[0] > 0.69 and turned[0] < 0.02
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
