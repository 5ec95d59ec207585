#!/usr/bin/env bash
# pycvcqv counts missing values for the interval of the coefficient of variation: with 30 of them 10 values have half of it.
#
# Expected: docstring of coefficient_of_variation: skipna (default True) excludes missing values when computing the result. The
#   interval is that of the values that are there.
# Seen: the default method, kelley, and the correction for small samples take the length with the missing values. Ten values have
#   0.087 to 0.235; with 30 missing ones beside them 0.104 to 0.164. The other methods (mckay, miller, vangel) do not.
# Hurts: repeated measurements in a table, where persons have different numbers of trials: who has fewest looks most certain.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pycvcqv==0.7.4
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pycvcqv import coefficient_of_variation

values = np.random.default_rng(1).normal(10, 2, 10)
seen = {}
for method in ("kelley", "mckay", "miller", "vangel"):
    for missing in (0, 10, 30):
        one = coefficient_of_variation(np.concatenate([values, [np.nan] * missing]), method=method)
        seen[method, missing] = one["lower"], one["upper"]
        print(f"{method}, 10 values and {missing} missing: {one['cv']:.4f}, interval {one['lower']:.4f} to {one['upper']:.4f}")
corrected = [coefficient_of_variation(one, correction=True)["cv"] for one in (values, np.concatenate([values, [np.nan] * 30]))]
print("corrected for the number of values:", corrected[0], "and with 30 missing", corrected[1])
print("pycvcqv", meta.version("pycvcqv"))
width = {key: high - low for key, (low, high) in seen.items()}
still = width["kelley", 30] < 0.5 * width["kelley", 0] and corrected[0] != corrected[1]
still &= all(seen[method, 30] == seen[method, 0] for method in ("mckay", "miller", "vangel"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
