#!/usr/bin/env bash
# reliabiliPy drops the signs of correlations of raw data: nine random items have an alpha of 0.65.
#
# Expected: docstring of reliability_analysis: takes the raw data, or their correlation matrix in their place; its readme: Cronbach's
#   alpha, Guttman's lambda 1 and 2, omega. All are made of sums of the correlations with their signs: items that have
#   nothing in common have an alpha around 0.
# Seen: of raw data, and only of them, the absolute values of the correlations are taken. The same data have an alpha of 0.65 as
#   data and of -0.86 as their correlation matrix. Of items that measure nothing in common, 30 persons, alpha is above 0.55
#   in each of 20 data sets.
# Hurts: every scale looks reliable, the more the fewer persons it has; an item that was to be turned round is not noticed.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.2.6 scipy==1.15.3 pandas==2.3.3 scikit-learn==1.5.2 factor_analyzer==0.5.1 reliabiliPy==0.0.36
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from reliabilipy import reliability_analysis


def alphas(items):
    raw = reliability_analysis(raw_dataset=items, is_corr_matrix=False)
    matrix = reliability_analysis(correlations_matrix=items.corr())
    raw.fit(), matrix.fit()
    return float(raw.alpha_cronbach), float(matrix.alpha_cronbach)


rng = np.random.default_rng(1)
seen = [alphas(pd.DataFrame(rng.normal(size=(30, 9)))) for _ in range(20)]
print(f"nine random items, 30 persons: alpha of the data {seen[0][0]:.2f}, of their correlations {seen[0][1]:.2f}")
print(f"20 data sets: of the data {min(s[0] for s in seen):.2f} to {max(s[0] for s in seen):.2f},", end=" ")
print(f"of their correlations {min(s[1] for s in seen):.2f} to {max(s[1] for s in seen):.2f}")
common = rng.normal(size=(200, 1)) + rng.normal(size=(200, 6))
turned = common * np.array([1, 1, 1, -1, -1, -1])
keyed = alphas(pd.DataFrame(common)), alphas(pd.DataFrame(turned))
print(f"six items with a common part: {keyed[0][0]:.2f} and {keyed[0][1]:.2f}; three of them turned: {keyed[1][0]:.2f} and {keyed[1][1]:.2f}")
print("reliabiliPy", meta.version("reliabiliPy"))
still = min(s[0] for s in seen) > 0.55 and np.mean([s[1] for s in seen]) < 0.2
still &= abs(keyed[0][0] - keyed[0][1]) < 1e-6 and abs(keyed[1][0] - keyed[0][0]) < 1e-6 and keyed[1][1] < 0.2
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
