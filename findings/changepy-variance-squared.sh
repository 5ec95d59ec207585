#!/usr/bin/env bash
# changepy's changes of a mean depend on the unit: the variance is squared once more and the squares are missing.
#
# Expected: docstring of normal_mean: the cost of a segment of a normal distribution with changing mean and the given variance;
#   pelt finds the changes that cost least (Killick et al., 2012). The cost is the sum of squares about the segment's mean
#   divided by the variance, so that data in mV with their variance and in uV with theirs have the same changes.
# Seen: it is divided by the squared variance, and in place of the sum of squares stands the sum of absolute values, divided by
#   the number. A step of three SDs between two hundred values is found alone with a variance of 1 or 9; with 0.09 there are
#   further changes beside it; with 0.01 or 100 none is found.
# Hurts: onsets and shifts, as of the excitability over a session: whether they are found depends on the unit.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 changepy==0.4.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from changepy import pelt
from changepy.costs import normal_mean

generator = np.random.default_rng(1)
values = np.concatenate([generator.normal(0, 1, 100), generator.normal(3, 1, 100)])


def right(data, variance):
    """The same search with the cost of the definition."""
    first, second = (np.concatenate([[0.0], np.cumsum(data**power)]) for power in (1, 2))
    return pelt(
        lambda a, b: (second[b] - second[a] - (first[b] - first[a]) ** 2 / (b - a)) / variance, len(data), 3 * np.log(len(data))
    )


seen = {}
for unit in (0.1, 0.3, 1.0, 3.0, 10.0):
    data, variance = values * unit, unit**2
    seen[unit] = [int(one) for one in pelt(normal_mean(data, variance), len(data))]
    print(f"SD {unit:g}, variance {variance:g}: changes at {seen[unit]}, by the definition at {[int(one) for one in right(data, variance)]}")
print("changepy", meta.version("changepy"))
still = seen[1.0] == seen[3.0] == [0, 100] and seen[0.1] == seen[10.0] == [0] and len(seen[0.3]) > 3
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
