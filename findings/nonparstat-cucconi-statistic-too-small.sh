#!/usr/bin/env bash
# NonParStat multiplies Cucconi's statistic where it should divide: two samples of 100 with p = 0.00004 have 0.55 for 10.2.
#
# Expected: docstring of cucconi_test: the Cucconi scale-location test; the result holds the statistic. Cucconi (1968), Marozzi (2009):
#   C = (U^2 + V^2 - 2 rho U V) / (2 (1 - rho^2)), which for large samples is compared with -ln(alpha), 3.0 for 5 %.
# Seen: the brackets are missing, so that C is multiplied by 1 - rho^2 and is too small by its square: 19 times for 200 values. The
#   p-value, from shuffled samples with the same factor, is not affected; the statistic cannot be looked up in a table.
# Hurts: whoever reports C, or compares it with published critical values: it is never significant.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 joblib==1.6.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps nonparstat==0.0.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from nonparstat.Cucconi import cucconi_test
from scipy.stats import rankdata

rng = np.random.default_rng(1)
first, second = rng.normal(0, 1, 100), rng.normal(0.5, 1.3, 100)
ranks = rankdata(np.concatenate([first, second]))[:100]
n, n1 = 200, 100
scale = np.sqrt(n1 * (n - n1) * (n + 1) * (2 * n + 1) * (8 * n + 11) / 5)
u, v = ((6 * (values**2).sum() - n1 * (n + 1) * (2 * n + 1)) / scale for values in (ranks, n + 1 - ranks))
rho = 2 * (n**2 - 4) / ((2 * n + 1) * (8 * n + 11)) - 1
right = (u**2 + v**2 - 2 * rho * u * v) / (2 * (1 - rho**2))
np.random.seed(1)
result = cucconi_test(first, second, method="permutation", replications=999)
seen = result.statistic
print(f"C by the definition {right:.2f}, asymptotic p {np.exp(-right):.5f}; NonParStat {seen:.2f}, which would be p {np.exp(-seen):.2f}")
print(f"p of the shuffled samples: {result.pvalue:.3f}")
print("NonParStat", meta.version("NonParStat"))
still = abs(result.statistic - right * (1 - rho**2) ** 2) < 1e-9 and right > 10 and result.statistic < 1 and result.pvalue < 0.01
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
