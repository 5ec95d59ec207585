#!/usr/bin/env bash
# doelab's analysis of variance takes one degree of freedom for each factor, however many levels it has: the table does not add up.
#
# Expected: the analysis of variance of an orthogonal array: the error has what the factors leave of n - 1, so 4 for two factors
#   of three levels in an L9, and the column DF adds up to its last row.
# Seen: the error has n minus the number of factors: 7 for 4 in that table, which adds up to 11 for 8; 6 for 2 with a third factor. F is
#   then 1.75 and 3 times too large. With two levels it is one degree too many.
# Hurts: screening of stimulation parameters: of pure noise 38 % of the factors are significant at 5 %, in tables of
#   three factors.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps doelab==0.1.1
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
import scipy.stats
from analysis.anova import anova
from doe.orthogonal_array import OrthogonalArray

array = OrthogonalArray("L9").create_orthogonal_array()
rng = np.random.default_rng(1)
seen = {}
for factors in (2, 3):
    table = anova(array.iloc[:, :factors], pd.Series(rng.normal(size=9)))
    degrees = [int(value) for value in table["DF"]]
    seen[factors] = degrees[-2], sum(degrees[:-1]), degrees[-1]
    print(f"{factors} factors of three levels: DF {degrees[:-1]}, which add up to {sum(degrees[:-1])}; total {degrees[-1]}")
significant = []
for _ in range(400):
    table = anova(array.iloc[:, :3], pd.Series(rng.normal(size=9)))
    significant += [scipy.stats.f.sf(float(f), 2, 6) < 0.05 for f in table["F"][:3]]
share = float(np.mean(significant))
print(f"pure noise, three factors: {share:.0%} of the factors are significant at 5 % by the table's F and DF")
print("doelab", meta.version("doelab"))
still = seen == {2: (7, 11, 8), 3: (6, 12, 8)} and share > 0.12
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
