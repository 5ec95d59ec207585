#!/usr/bin/env bash
# permutation-test's Benjamini-Hochberg procedure stops at the first p above its line: p = 0.03 and 0.04 are not significant.
#
# Expected: docstring of benjamini_hochberg_procedure: says which null hypotheses are rejected and controls the false-discovery
#   rate. Benjamini and Hochberg (1995) look for the largest rank k whose p is at most k / m * alpha and reject all k:
#   for 0.03 and 0.04 and alpha 0.05 that is 2, as 0.04 <= 0.05.
# Seen: it goes up from the smallest p and stops at the first above its line, 0.03 > 0.025: none is rejected. In one of
#   twenty made-up families of ten tests, five with an effect, a part of the rejections is lost.
# Hurts: the command line uses it for every table with more than one column, so that several real effects are reported as
#   "NO" because the smallest p among them was not small enough by itself.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.0.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps permutation_test==0.18
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from permutation_test.functions import benjamini_hochberg_procedure
from scipy.stats import false_discovery_control, norm

seen = {}
for family in ([0.03, 0.04], [0.01, 0.04, 0.045, 0.048], [0.001, 0.02, 0.3]):
    right = (false_discovery_control(family) <= 0.05).tolist()
    seen[tuple(family)] = (benjamini_hochberg_procedure(family).tolist(), right)
    print(f"{family}: rejected by definition {right}, by the package {seen[tuple(family)][0]}")
rng = np.random.default_rng(1)
families = [norm.sf(rng.normal(size=10) + 2.2 * (np.arange(10) < 5)) for _ in range(2000)]
counts = [(benjamini_hochberg_procedure(one).sum(), (false_discovery_control(one) <= 0.05).sum()) for one in families]
lost = np.mean([found < right for found, right in counts])
print(f"ten tests, five effects: rejections {np.mean([c[1] for c in counts]):.2f}, by the package {np.mean([c[0] for c in counts]):.2f}; fewer in {lost:.0%}")
print("permutation_test", meta.version("permutation_test"))
still = seen[0.03, 0.04] == ([False, False], [True, True]) and seen[0.001, 0.02, 0.3][0] == seen[0.001, 0.02, 0.3][1]
still &= all(found <= right for found, right in counts) and 0.02 < lost < 0.1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
