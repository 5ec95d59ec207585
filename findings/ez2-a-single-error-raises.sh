#!/usr/bin/env bash
# EZ2 cannot simulate a person with exactly one error: TypeError.
#
# Expected: help of rddexitj: a random sample of exit times from top and bottom of a diffusion process, as two lists. How many are
#   at the bottom (errors) is drawn, and may be any number.
# Seen: if one number is drawn, the quantile function returns it without a list, and rddexitj fails on it. None and two work.
# Hurts: power simulations and parameter recovery stop at random: with 60 trials and 5 % errors in one of six persons; who
#   catches the error and draws again leaves out just the persons with one error.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==2.3.3 EZ2==0.0.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import EZ2
import numpy as np

TRIALS, DRIFT, START, A = 60, 0.25, 0.06, 0.12
rate = float(EZ2.pe(DRIFT, START, A))
seen = {}
for seed in range(60):
    np.random.seed(seed)
    errors = np.random.binomial(TRIALS, rate)
    np.random.seed(seed)
    try:
        (wrong, right), _ = EZ2.rddexitj(TRIALS, DRIFT, START, A)
        result = "works" if len(wrong) == errors and len(right) == TRIALS - errors else "other numbers"
    except TypeError as error:
        result = "TypeError"
    seen.setdefault(errors, set()).add(result)
for errors, results in sorted(seen.items()):
    print(f"{errors} errors: {', '.join(sorted(results))}")
print(f"rate of errors {rate:.3f}; EZ2", meta.version("EZ2"))
still = all(results == ({"TypeError"} if errors == 1 else {"works"}) for errors, results in seen.items())
still &= {0, 1, 2} <= set(seen)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
