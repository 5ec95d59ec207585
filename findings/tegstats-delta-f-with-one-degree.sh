#!/usr/bin/env bash
# tegstats looks up the F of added predictors with their own number for both degrees of freedom: p is 0.17 for 0.0006.
#
# Expected: README: teg_regression lets one test the additional explained variance of predictors added to a baseline model. The
#   p-value of that F has the number of added predictors and the residual degrees of freedom, which it reports.
# Seen: the distribution has the added predictors for both, F(1, 1) in place of F(1, 56), and the residual ones are one too many
#   (57). One added predictor with F = 13 has p = 0.17; its own t-test in the same result has 0.0006.
#   (Its modules import each other by bare names, so its folder is put on the path.)
# Hurts: hierarchical regression: with one predictor added F must be above 161 to be significant.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 statsmodels==0.15.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps tegstats==0.0.5
cd "$tmp"
PYTHONPATH=$(echo "$tmp"/venv/lib/python3*/site-packages/tegstats) "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import statsmodels.api as sm
from tegstats import teg_regression

rng = np.random.default_rng(1)
baseline, added = rng.normal(size=(60, 2)), rng.normal(size=(60, 1))
y = baseline[:, 0] + 0.35 * added[:, 0] + rng.normal(size=60)
result = teg_regression(added, y, baseline_X=baseline)
full = sm.OLS(y, sm.add_constant(np.hstack([added, baseline]))).fit()
f, p, df = full.compare_f_test(sm.OLS(y, sm.add_constant(baseline)).fit())
print(f"F({result['Delta_df1']}, {result['Delta_df2']}) = {result['Delta_F']:.2f}, p = {result['Delta_p']:.4f}")
print(f"p of the added predictor's t in the same result: {result['t_p'][0]:.4f}")
print(f"statsmodels: F({df:.0f}, {full.df_resid:.0f}) = {f:.2f}, p = {p:.4f}")
print("tegstats", meta.version("tegstats"))
still = result["Delta_p"] > 0.15 and result["t_p"][0] < 0.001 and np.isclose(p, result["t_p"][0]) and result["Delta_df2"] == 57
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
