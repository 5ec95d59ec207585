#!/usr/bin/env bash
# bootstrap-ci draws new samples for a second interval but keeps the first ones' values; hierarchical ones raise TypeError.
#
# Expected: readme: ci(coverages, nr_bootstrap_samples, seed, ...) of one instance, called again and again in its examples; comment
#   in ci: with nr_bootstrap_samples it samples again, otherwise it uses the samples drawn before. sampling="hierarchical" with
#   sampling_args is a documented argument of ci.
# Seen: the statistic is computed once for each instance: after a call with 10 samples, one with 20000 and another seed has the
#   interval of the 10, to the last digit. ci does not hand sampling_args to the sampling: TypeError.
# Hurts: who tries with few samples first, or compares seeds to see whether there are enough, always sees the first result
#   again and takes it for stable.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.2.6 scipy==1.15.3 numba==0.61.2 llvmlite==0.44.0 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps bootstrap-ci==0.0.1
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from bootstrap_ci import Bootstrap

values = np.random.default_rng(1).exponential(1, 20)
ask = {"side": "two", "method": "percentile"}
one = Bootstrap(values, np.mean)
first = one.ci(0.95, nr_bootstrap_samples=10, seed=1, **ask)
second = one.ci(0.95, nr_bootstrap_samples=20000, seed=2, **ask)
fresh = Bootstrap(values, np.mean).ci(0.95, nr_bootstrap_samples=20000, seed=2, **ask)
for case, interval in (("10 samples", first), ("then 20000", second), ("20000 of a new instance", fresh)):
    print(f"{case}: {interval[0]:.4f} to {interval[1]:.4f}")
groups = [[0, 1, 2, 3, 4], [5, 6, 7, 8, 9], list(range(10, 20))]
try:
    cases = {"method": "cases", "strategy": [1, 1]}
    Bootstrap(values, np.mean, group_indices=groups).ci(
        0.95, nr_bootstrap_samples=100, sampling="hierarchical", sampling_args=cases, **ask
    )
    hierarchical = "an interval"
except TypeError as error:
    hierarchical = f"TypeError: {error}"
print("hierarchical:", hierarchical)
print("bootstrap-ci", meta.version("bootstrap-ci"))
still = np.array_equal(first, second) and not np.allclose(second, fresh, atol=0.02) and hierarchical.startswith("TypeError")
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
