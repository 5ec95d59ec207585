#!/usr/bin/env bash
# hypothetical's Wilson interval is that of the expected proportion, not of the one seen: 682 of 925 have 0.47 to 0.53.
#
# Expected: docstring of BinomialTest: four intervals for the probability of success; Wilson's is made with the proportion seen.
# Seen: it is made with p, the proportion of the null hypothesis, one half by default: 682 successes of 925 (0.737) have 0.468 to
#   0.532, as has any other result, and as the docstring's own example shows beside three intervals from 0.707 to 0.765. For
#   "greater" Agresti and Coull's and the arcsine's begin above the estimate: the quantile is negative there, and is subtracted.
# Hurts: proportions of responses and hit rates: the interval depends on the number of trials alone.
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

seen = []
for successes in (682, 100, 900):
    test = BinomialTest(925, successes, continuity=False)
    low, high = (round(float(one), 3) for one in test.wilson_score_interval["interval"])
    right = binomtest(successes, 925).proportion_ci(method="wilson")
    seen.append((low, high))
    print(f"{successes} of 925 ({successes / 925:.3f}): Wilson {low} to {high}; scipy {right.low:.3f} to {right.high:.3f}")
above = BinomialTest(925, 682, alternative="greater")
lower = {name: float(one["interval"][0]) for name, one in above.test_summary["intervals"].items()}
print("greater, lower limits:", {name: round(one, 3) for name, one in lower.items()})
print("hypothetical", meta.version("hypothetical"))
still = seen == [(0.468, 0.532)] * 3 and lower["Agresti-Coull"] > 682 / 925 and lower["Arcsine Transform"] > 682 / 925
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
