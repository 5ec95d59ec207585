#!/usr/bin/env bash
# reliability-stability-calc sets the lower limit of a difference to zero: an interval of -0.41 to -0.25 is printed as "0.0 and -0.21".
#
# Expected: documentation: "implement a bootstap test to test assumptions", with a percentile interval for assumption_test, a difference of two
#   transformed products of correlations that is zero if Heise's (1969) assumption holds, and changes its sign if two columns are exchanged.
# Seen: the limits are max(0.0, ...) and min(1.0, ...), those for a share. A negative difference has a lower limit above the upper one, none
#   is ever significantly negative, and without any difference the interval begins at its middle. The samples have half of the persons, so that
#   the interval is wider by the root of two.
# Hurts: test-retest studies in three sessions: whether the assumption is violated depends on the order in which two columns are named.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 pandas==2.2.3 matplotlib==3.10.8
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps reliability-stability-calc==0.0.4
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import contextlib
import importlib.metadata as meta
import io
import sys

import numpy as np
import pandas as pd
from reliability_stability.reliability_stability import assumption_test, bootstrap_assumption_test

rng = np.random.default_rng(1)
trait = rng.normal(size=400)
shared = {"a": 0.9, "b": 0.0}
table = pd.DataFrame({name: trait + rng.normal(0, 0.8, 400) for name in "abcd"})
table["d"] += 1.2 * (table["a"] - trait)  # a and d share an error: the assumption does not hold
seen = {}
for name, columns in {"a, b": "abcd", "b, a": "bacd"}.items():
    np.random.seed(1)
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        bootstrap_assumption_test(table, *columns, 400, 0.95)
    words = printed.getvalue().split()
    low, high = float(words[-3]), float(words[-1])
    whole = [assumption_test(table.sample(400, replace=True, random_state=seed), *columns) for seed in range(400)]
    right = np.percentile(whole, [2.5, 97.5])
    seen[name] = (low, high, *right)
    print(f"columns {name}, c, d: difference {assumption_test(table, *columns):.2f}; printed {low:.2f} and {high:.2f}, with all persons {right[0]:.2f} and {right[1]:.2f}")
print("reliability-stability-calc", meta.version("reliability-stability-calc"))
first, second = seen["a, b"], seen["b, a"]
still = min(first[0], second[0]) == 0 and any(low == 0 and high < 0 and right_high < 0 for low, high, _, right_high in seen.values())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
