#!/usr/bin/env bash
# sample-size-calculator tests means as proportions: 0.4 and 0.8 mV differ with p = 0.005, 400 and 800 uV with nan.
#
# Expected: docstring of analyze_test_results: compares two groups' means or proportions. A comparison of means needs their spread,
#   and without it should be refused; the unit must not decide.
# Seen: p (1 - p) is taken for the variance of every mean. Between 0 and 1 the result is that of two proportions, whatever the
#   spread; above 1 the variance is negative: standard error, z and p are nan, the decision is "not significant", and nothing is
#   raised.
# Hurts: mean MEPs in mV get a p value that has nothing to do with them, and those in uV are never significant.
# (Needs a Python before 3.12.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 matplotlib==3.9.4 statsmodels==0.14.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps sample-size-calculator==1.0.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from sample_size_calculator import analyze_test_results

seen = {}
for unit, scale in (("mV", 1), ("uV", 1000)):
    result = analyze_test_results(20, 0.4 * scale, 0.8 * scale)
    seen[unit] = (float(result["p_value"]), bool(result["overall_significant"]))
    print(f"20 persons each, means of {0.4 * scale:g} and {0.8 * scale:g} {unit}: p = {seen[unit][0]:.4f}, significant: {seen[unit][1]}")
print("sample-size-calculator", meta.version("sample-size-calculator"))
still = abs(seen["mV"][0] - 0.0047) < 1e-3 and seen["mV"][1] and np.isnan(seen["uV"][0]) and not seen["uV"][1]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
