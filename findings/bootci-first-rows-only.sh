#!/usr/bin/env bash
# BootCI draws a smaller resample from the first rows only.
#
# Expected: docstring of Bootstrap: sample_size is the "size of resampling sample"; the distribution is that of the statistic on
#   bootstrap samples of the data. Ten of a hundred persons are any ten.
# Seen: row numbers are drawn below sample_size: with 10 only the first ten persons are ever drawn. If the first system is 1
#   better in the first ten persons and as good in all others, the difference is 0.1, and the interval 1 to 1; in the
#   other order of rows it is 0 to 0.
# Hurts: subsampling, also that of a large record; the result depends on how the table is sorted, by time or by group.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps BootCI==1.0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from BootCI.paired_bootstrap_interval import Bootstrap



def mean_score(predicted, true):
    return float(np.mean(predicted - true))


rng = np.random.default_rng(1)
true = rng.normal(size=100)
better = np.arange(100) < 10
seen = {}
for name, order in (("better ones first", np.arange(100)), ("better ones last", np.arange(100)[::-1])):
    first, second, outcome = (true + better)[order], true[order], true[order]
    for size in (10, 100):
        np.random.seed(1)
        sample = Bootstrap(first, second, outcome, stat=mean_score, n_iter=500, sample_size=size)
        low, high = sample.get_confidence_interval(0.05, method="sampling")
        seen[name, size] = round(float(low), 2), round(float(high), 2)
        print(f"{name}, resamples of {size}: difference {sample.theta:.2f}, interval {seen[name, size][0]} to {seen[name, size][1]}")
print("BootCI", meta.version("BootCI"))
still = (
    seen["better ones first", 10] == (1.0, 1.0)
    and seen["better ones last", 10] == (0.0, 0.0)
    and all(low < 0.1 < high for (_, size), (low, high) in seen.items() if size == 100)
)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
