#!/usr/bin/env bash
# wrs2_py's bootstrap test with equal tails has the p of one side: an interval of -3.4 to -2.5 has p = 1, with the groups exchanged p = 0.
#
# Expected: yuenbt is "Bootstrap Yuen's test for trimmed means"; side=False gives the equal-tailed interval of the bootstrap t (Wilcox 2017).
#   A 95 % interval that leaves out zero belongs to a p below 0.05, and p does not depend on which group is named first.
# Seen: with side=False p is the share of bootstrap values of t above the one observed. If the first group is lower it is near 1, whatever
#   the difference; for no difference it is uniform, so that 2.5 % of samples have a p below 0.025 in one direction and none in the other.
# Hurts: comparisons of two groups with skewed data: half of all real differences are "not significant", beside an interval that says else.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps wrs2-py==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from wrs2_py import yuenbt

rng, seen = np.random.default_rng(1), {}
low, high = rng.normal(0, 1, 20), rng.normal(3, 1, 20)
for name, groups in {"lower group first": (low, high), "higher group first": (high, low)}.items():
    np.random.seed(1)
    equal = yuenbt(*groups, nboot=599, side=False)
    np.random.seed(1)
    symmetric = yuenbt(*groups, nboot=599, side=True)
    seen[name] = (float(equal["p_value"]), float(symmetric["p_value"]), *map(float, equal["conf_int"]))
    print(f"{name}: equal tails p = {seen[name][0]:.3f}, interval {seen[name][2]:.1f} to {seen[name][3]:.1f}; symmetric p = {seen[name][1]:.3f}")
print("wrs2-py", meta.version("wrs2-py"))
still = seen["lower group first"][0] > 0.99 and seen["higher group first"][0] < 0.01 and seen["lower group first"][3] < 0
still = still and max(values[1] for values in seen.values()) < 0.01
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
