#!/usr/bin/env bash
# jackknife corrects the bias as if one observation were left out, however many are: a variance of 0.32 is 0.49 with four left out.
#
# Expected: docstring of jk_stats: "theta_jack: The bias-corrected Jackknife Estimates", d "the number of observations to leave out". With d
#   left out the bias is (N - d) / d times the mean difference (Shao and Wu, Ann. Statist. 17 (1989); Efron and Tibshirani 1993, 11.7), which
#   makes the variance with divisor N exactly that with divisor N - 1, for every d.
# Seen: the factor is always N - 1, that for d = 1. The standard error, which has d in it, is right.
# Hurts: small samples, for which its documentation calls d of 3 reasonable: the estimate has a bias in the other direction, 29 % for ten
#   values with three left out; its t and p are made with it.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps jackknife==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from jackknife import jk_loop, jk_stats

values, seen = np.random.default_rng(1).normal(size=(10, 1)), {}
right = float(values.var(ddof=1))
for left_out in (1, 2, 3, 4):
    parts, whole = jk_loop(lambda rows: np.var(rows, axis=0), values, d=left_out)
    estimate = float(jk_stats(parts, whole, N=10, d=left_out)[2][0])
    by_formula = float(whole[0] - (10 - left_out) / left_out * (parts.mean() - whole[0]))
    seen[left_out] = (estimate / right, by_formula / right)
    print(f"{left_out} left out: variance {estimate:.4f}, by the formula for d {by_formula:.4f}, with divisor N - 1 {right:.4f}")
print("jackknife", meta.version("jackknife"))
still = all(abs(seen[d][0] - 9 / (10 - d)) < 1e-9 and abs(seen[d][1] - 1) < 1e-9 for d in seen)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
