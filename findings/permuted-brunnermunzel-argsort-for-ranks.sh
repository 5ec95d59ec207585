#!/usr/bin/env bash
# permuted-brunnermunzel takes the order in which values are sorted for their ranks: its p-value depends on the order of persons.
#
# Expected: docstring of permuted_brunnermunzel: the permuted Brunner-Munzel test, as R's brunnermunzel; the estimate is
#   P(X < Y) + P(X = Y) / 2. All x are below all y in the docstring's own example, so the estimate is 1.
# Seen: ranks are numpy's argsort: the places of the sorted values, from zero, and ties are not shared. In that example the
#   estimate is 0.857. With all x above all y it is -0.143. The same two groups of seven, written down in another order, have
#   estimates from 0.47 to 0.69 (0.71 by the definition) and p-values from 0.09 to 0.57.
# Hurts: everyone with small groups, for which the test is meant: p is a matter of how the table is sorted.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps permuted-brunnermunzel==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - 2>/dev/null <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from permuted_brunnermunzel import permuted_brunnermunzel

above, below = [30, 20, 19, 18, 15, 10], [0, 0, 0, 1, 1, 1, 0]
first = float(permuted_brunnermunzel(below, above)[0])
last = float(permuted_brunnermunzel(list(range(10, 17)), list(range(7)))[0])
print(f"all x below all y: {first:.3f}; all x above all y: {last:.3f}")
rng = np.random.default_rng(1)
x, y = rng.normal(0, 1, 7), rng.normal(0.5, 1, 7)
true = float(np.mean(np.less.outer(x, y)))
seen = []
for _ in range(12):
    estimate, p = permuted_brunnermunzel(rng.permutation(x).tolist(), rng.permutation(y).tolist())
    seen.append((float(estimate), float(p)))
    print(f"the same two groups in another order: estimate {estimate:.3f} (by definition {true:.3f}), p = {p:.3f}")
print("permuted-brunnermunzel", meta.version("permuted-brunnermunzel"))
spread = np.ptp(seen, axis=0)
still = round(first, 3) == 0.857 and last < 0 and spread[0] > 0.2 and spread[1] > 0.3
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
