#!/usr/bin/env bash
# ezbootstrap draws as many values into each sample as there are samples: of 20 values the standard error is 0.014, not 0.22.
#
# Expected: docstring of bs_1sample and bs_2sample: bootstrap replicates; size is the number of replicates to generate, 5000 if
#   nothing is said. A bootstrap sample has as many values as the data (Efron, 1979), as those of bs_pairs have.
# Seen: size is the number of values of each sample, too: twenty values with a standard error of the mean of 0.22 have one of
#   0.045, 0.020 and 0.014 with 500, 2500 and 5000 replicates. Of two groups of different sizes both have 5000.
# Hurts: intervals of a mean or of a difference are as narrow as one likes: with the default 16 times too narrow for 20 persons;
#   every difference between groups is significant.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.2.6 numba==0.61.2 llvmlite==0.44.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps ezbootstrap==0.0.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from ezbootstrap import bs_1sample, bs_2sample


def mean(data):
    return np.mean(data)


def difference(first, second):
    return np.mean(first) - np.mean(second)


generator = np.random.default_rng(1)
values, others = generator.normal(0, 1, 20), generator.normal(0, 1, 10)
values, others = values / values.std(), others / others.std()
right = values.std() / len(values) ** 0.5
print(f"20 values: standard error of the mean {right:.3f}")
still = True
for size in (500, 2500, 5000):
    found = float(bs_1sample(values, mean, size=size).std())
    print(f"{size} replicates: {found:.4f}")
    still &= abs(found / (values.std() / size**0.5) - 1) < 0.1
low, high = np.quantile(bs_2sample(values, others, difference), [0.025, 0.975])
width = 2 * 1.96 * (values.var() / 20 + others.var() / 10) ** 0.5
print(f"two groups of 20 and 10 of one distribution: 95 % are {low:.2f} to {high:.2f}, {width / (high - low):.0f} times too narrow")
still &= bool(width / (high - low) > 10)
print("ezbootstrap", meta.version("ezbootstrap"), "numba", meta.version("numba"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
