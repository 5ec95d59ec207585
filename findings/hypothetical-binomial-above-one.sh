#!/usr/bin/env bash
# hypothetical's binomial test leaves out likely results: 5 of 20 are significantly more than half, and 10 of 20 have p = 1.18.
#
# Expected: docstring of BinomialTest: the alternative "greater" has the probability of at least as many successes, the two-sided
#   one that of all results that are at most as likely as the one seen.
# Seen: for "greater" only those of at least x that are also at most as likely count: for 5 of 20 that is 5 itself and 15 to 20, so
#   p = 0.035 for 0.994. Two-sided p is twice that sum: 0.071 for 0.041 with 5 of 20, 0.041 with 15 of 20, 1.18 with 10.
#   The sign test uses it.
# Hurts: yes-or-no answers against chance: who is below it is above it, and the same distance has two p-values.
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

from hypothetical.hypothesis import BinomialTest
from scipy.stats import binomtest

seen = {}
for alternative in ("greater", "two-sided"):
    for successes in (5, 8, 10, 15):
        p = float(BinomialTest(20, successes, alternative=alternative).p_value)
        right = float(binomtest(successes, 20, alternative=alternative).pvalue)
        seen[alternative, successes] = round(p, 3), round(right, 3)
        print(f"{successes} of 20, {alternative}: p = {p:.4f}; scipy {right:.4f}")
print("hypothetical", meta.version("hypothetical"))
still = seen["greater", 5] == (0.035, 0.994) and seen["two-sided", 5] == (0.071, 0.041) and seen["two-sided", 10] == (1.176, 1.0)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
