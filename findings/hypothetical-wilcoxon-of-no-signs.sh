#!/usr/bin/env bash
# hypothetical's Wilcoxon test leaves out the signs: ten differences have p = 0.005, whatever they are.
#
# Expected: docstring of WilcoxonTest: the signed rank test of matched pairs: V is the sum of the ranks of the positive differences.
# Seen: ranks of the signed differences are taken for the differences, and a rank is always positive: V is the sum of all ranks,
#   n (n + 1) / 2. Ten pairs without any difference between the conditions have V = 55, z = 2.8 and p = 0.005 as ten pairs that
#   all rise; with 20 pairs p is 0.0001. "greater" and "less" have one p for every sample, too.
# Hurts: every use: any two conditions differ significantly from six pairs on.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.3.3 statsmodels==0.14.4 \
    numpy-indexed==0.3.7
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps hypothetical==0.3.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from hypothetical.nonparametric import WilcoxonTest
from scipy.stats import wilcoxon

rng = np.random.default_rng(1)
seen = {}
for number in (6, 10, 20):
    for name, shift in (("no difference", 0.0), ("a difference", 1.0), ("the opposite", -1.0)):
        first, second = rng.normal(shift, 1, number), rng.normal(0, 1, number)
        test = WilcoxonTest(first, second)
        seen[number, name] = float(test.V), float(test.p)
        print(f"{number} pairs, {name}: V = {test.V:.0f}, p = {test.p:.4f}; scipy p = {wilcoxon(first, second).pvalue:.4f}")
print("hypothetical", meta.version("hypothetical"))
still = all(value == seen[number, "a difference"] for (number, _), value in seen.items())
still &= seen[10, "no difference"][0] == 55 and seen[6, "no difference"][1] < 0.05
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
