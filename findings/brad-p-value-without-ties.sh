#!/usr/bin/env bash
# brad's permutation test does not count ties: where p can be no smaller than 0.05 it is 0.
#
# Expected: p_value of a permutation test: the share of permutations with a statistic at least as large as the observed one; the
#   observed order is one of the permutations, so p is never 0. Three against three persons, all higher: 1 of 20 orders, p =
#   0.05.
# Seen: only larger statistics are counted. p is 0 for every complete separation, and for all groups alike it is 0 too.
# Hurts: small groups and answers that are whole numbers, so many ties: p is always too small, and 2 against 2 persons are
#   "significant".
# (numpy 1.26 needs a Python before 3.13.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 scikit-learn==1.5.2 brad==0.2.0a0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import brad
import numpy as np

from itertools import combinations


def difference(values, labels):
    return float(values[labels == 1].mean() - values[labels == 0].mean())


still = True
for case, values, size in (
    ("2 against 2, all higher", np.array([1.0, 2, 3, 4]), 2),
    ("3 against 3, all higher", np.array([1.0, 2, 3, 4, 5, 6]), 3),
    ("ratings with ties", np.array([1.0, 2, 2, 2, 2, 3, 2, 3, 3, 3]), 5),
    ("all the same", np.ones(8), 4),
):
    labels = (np.arange(values.size) >= size).astype(int)
    observed = difference(values, labels)
    orders = [np.isin(np.arange(values.size), chosen).astype(int) for chosen in combinations(range(values.size), size)]
    exact = np.mean([difference(values, order) >= observed - 1e-12 for order in orders])
    found = brad.permutation_test(values, labels, 5000, statistic=difference).p_value()
    print(f"{case}: p {found:.3f}, of all {len(orders)} orders {exact:.3f}")
    still &= bool(found == 0 if "ratings" not in case else found < exact / 2)
print("brad", meta.version("brad"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
