#!/usr/bin/env bash
# hypothetical's Friedman test ranks each value against its condition's number: in mV nothing differs, in uV everything does.
#
# Expected: docstring of FriedmanTest: samples are the columns of a matrix, which are ranked within each row; the statistic's degrees
#   of freedom are the number of samples minus one. The unit changes nothing.
# Seen: the samples are put below each other, with the sample's number beside each value, and these two are ranked: two conditions,
#   number and value, in as many rows as there are values. Three conditions of ten persons that differ (p = 0.0001) have p = 0.14 in
#   mV, where values are partly above 0, 1 and 2; in uV they have p = 0.00000004, as have three that are alike (0.27).
# Hurts: repeated measures of three and more conditions: every result.
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
from hypothetical.nonparametric import FriedmanTest
from scipy.stats import friedmanchisquare

rng = np.random.default_rng(1)
person = rng.uniform(0.5, 1.5, (10, 1))
noise = rng.uniform(-0.2, 0.2, (10, 3))
seen = {}
for name, shift in (("conditions differ", [0, 0.3, 0.6]), ("conditions are alike", [0, 0, 0])):
    for unit, factor in (("mV", 1), ("uV", 1000)):
        data = (person + noise + shift) * factor
        test = FriedmanTest(*data.T, group=None)
        seen[name, unit] = float(test.p_value)
        print(f"{name}, {unit}: {test.n} rows of {test.k}, p = {test.p_value:.2g}; scipy p = {friedmanchisquare(*data.T).pvalue:.2g}")
print("hypothetical", meta.version("hypothetical"))
still = seen["conditions differ", "mV"] > 0.1 and all(seen[one, "uV"] < 1e-6 for one in ("conditions differ", "conditions are alike"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
