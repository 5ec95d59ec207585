#!/usr/bin/env bash
# effect-size-analysis exchanges the sizes of the groups in the interval of Cliff's delta: with 8 and 60 it is three times as wide.
#
# Expected: docstring of cliff_delta: the delta and its confidence interval (Cliff, 1993), where the spread of the 8 persons' own
#   deltas is multiplied by the square of 60, and that of the 60 persons' by the square of 8. delta is between -1 and 1.
# Seen: each is multiplied by the square of its own size. For groups of one size nothing changes; for 8 and 60 the 95 % interval
#   is about three times as wide (2.3 for 0.8), beyond 1, and holds the true value always. The accurate interval has the same error.
# Hurts: comparisons of few patients with many controls: no difference can be found.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation effect-size-analysis==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from effect_size_analysis.cliff_delta import cliff_delta
from scipy.stats import norm


def by_definition(first, second):
    """Delta, and the half width of its 95 % interval."""
    signs = np.sign(np.subtract.outer(first, second))
    m, n = signs.shape
    delta = signs.mean()
    rows, columns = ((signs.mean(axis=axis) - delta) ** 2 for axis in (1, 0))
    variance = n**2 * rows.sum() + m**2 * columns.sum() - ((signs - delta) ** 2).sum()
    return delta, 1.96 * np.sqrt(variance / (m * n * (m - 1) * (n - 1)))


rng = np.random.default_rng(1)
true = 2 * norm.cdf(0.5 / np.sqrt(2)) - 1
seen = {}
for sizes in ((10, 10), (20, 40), (8, 60), (60, 8)):
    rows = []
    for _ in range(200):
        first, second = rng.normal(0.5, 1, sizes[0]), rng.normal(0, 1, sizes[1])
        delta, (low, high) = cliff_delta(first, second)
        right, half = by_definition(first, second)
        rows.append((high - low, 2 * half, low <= true <= high, abs(right - true) <= half, delta == right))
    seen[sizes] = np.mean(rows, axis=0)
    print(f"{sizes[0]} and {sizes[1]} persons: width {seen[sizes][0]:.2f} for {seen[sizes][1]:.2f}", end=", ")
    print(f"holds the true delta in {seen[sizes][2]:.0%}, by the definition in {seen[sizes][3]:.0%}")
print("effect-size-analysis", meta.version("effect-size-analysis"))
still = np.isclose(*seen[10, 10][:2], rtol=1e-3) and all(seen[one][0] > 2.5 * seen[one][1] for one in ((8, 60), (60, 8)))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
