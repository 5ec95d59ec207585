#!/usr/bin/env bash
# hypothetical's McNemar test compares those who did not change: 15 against 2 who did have p = 0.83.
#
# Expected: docstring of McNemarTest: the test of two related proportions in a table of pairs, whose statistic is made of the two
#   cells in which the pairs differ, n12 and n21.
# Seen: it is made of the other diagonal, n11 and n22; without the correction the numerator is. 40 who respond both times, 43 who
#   never do, 15 who only do after and 2 only before have chi squared 0.05 and p = 0.83 for 8.5 and 0.0036; the asymptotic z
#   and the exact p (0.002) of the same object are right.
# Hurts: responders before and after an intervention: a change is not found, a common rate of one half is never significant.
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

from hypothetical.contingency import McNemarTest
from statsmodels.stats.contingency_tables import mcnemar

seen = []
for table in ([[40, 2], [15, 43]], [[10, 9], [9, 72]]):
    for correction in (True, False):
        test = McNemarTest(table, continuity=correction)
        right = mcnemar(table, exact=False, correction=correction)
        seen.append((round(float(test.mcnemar_p_value), 3), round(float(right.pvalue), 3)))
        print(f"{table}, continuity={correction}: chi squared {test.mcnemar_x2_statistic:.3f}, p = {test.mcnemar_p_value:.4f}", end="; ")
        print(f"exact p {test.exact_p_value:.4f}; statsmodels {right.statistic:.3f}, p = {right.pvalue:.4f}")
print("hypothetical", meta.version("hypothetical"))
still = seen[0] == (0.826, 0.004) and seen[1] == (0.467, 0.002) and seen[2][0] < 0.001 and seen[2][1] > 0.8
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
