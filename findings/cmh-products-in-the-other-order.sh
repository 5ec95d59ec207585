#!/usr/bin/env bash
# cmh exchanges rows and columns in the covariance: for three answers and three groups p is 0.07 for 0.0006, and 0.006 for 0.18.
#
# Expected: docstring of CMH: the Cochran-Mantel-Haenszel statistic as in Agresti (2002), page 295, and R's mantelhaen.test. With one
#   stratum it is (n - 1) / n of Pearson's chi-squared, a textbook identity, whatever the order of the labels.
# Seen: the cells are taken row by row, the covariance is made for cells taken column by column. With two answers or two groups this
#   is the same; from three by three on it is another statistic, too small or too large, and another one by the order of the labels.
# Hurts: rating scales in several sites or sessions: strong relations are not significant, and weak ones are.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps cmh==1.0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from cmh import CMH
from scipy.stats import chi2, chi2_contingency


def persons(table):
    rows = [("one", answer, group) for (answer, group), number in np.ndenumerate(table) for _ in range(number)]
    return pd.DataFrame(rows, columns=["site", "answer", "group"])


seen = {}
tables = {
    "two by two": [[14, 5], [6, 12]],
    "strong": [[4, 4, 8], [17, 30, 2], [9, 12, 4]],
    "weak": [[16, 3, 10], [15, 4, 16], [18, 4, 4]],
}
for name, table in tables.items():
    table = np.array(table)
    right = chi2_contingency(table, correction=False)[0] * (table.sum() - 1) / table.sum()
    value, freedom, p = CMH(persons(table), "group", "answer", "site", raw=True)
    turned = CMH(persons(table[:, ::-1]), "group", "answer", "site", raw=True)[0]
    seen[name] = [round(float(one), 2) for one in (value, turned, right)]
    print(f"{name}: {value:.2f} (p = {p:.4f}), groups in the other order {turned:.2f}; right {right:.2f} (p = {chi2.sf(right, freedom):.4f})")
print("cmh", meta.version("cmh"))
still = len(set(seen["two by two"])) == 1 and seen["strong"][0] < 9 < 19 < seen["strong"][2] and seen["weak"][2] < 7 < 14 < seen["weak"][0]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
