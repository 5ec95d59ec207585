#!/usr/bin/env bash
# bsci corrects each column by the mean of all columns: means of 0 and 100 become -50 and 150.
#
# Expected: compute_interval accepts data with two dimensions ("Only 1-dim and 2-dim data is supported!") and a statistic with an axis; its
#   bias correction is the bootstrap's (its reference [2]): the mean over the samples minus the estimate, for each column. A mean has none.
# Seen: the mean is taken over the samples of all columns together. With two columns around 0 and 100 the "bias" is 50 and -50, so that the
#   corrected means are -50 and 150, and both intervals are around 50.
# Hurts: data of several muscles or conditions in one table: each is moved away from the others, in silence.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps bsci==1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from bsci.bootstrapped_confidence_intervals import compute_interval

rng, seen = np.random.default_rng(1), {}
table = np.column_stack([rng.normal(0, 1, 50), rng.normal(100, 1, 50)])
for corrected in (False, True):
    mean, low, high = compute_interval(table, np.mean, 2000, 0.95, 2, bias_correction=corrected, seed=1)
    seen[corrected] = np.array([mean, low, high])
    print(f"bias corrected {corrected}: means {np.round(mean, 1)}, limits {np.round(low, 1)} and {np.round(high, 1)}")
print("columns' own means:", table.mean(axis=0).round(1))
print("bsci", meta.version("bsci"))
still = np.allclose(seen[False][0], table.mean(axis=0)) and np.allclose(seen[True][0], [-50, 150], atol=0.5)
still = still and np.all(np.abs(seen[True][1:] - 50) < 1)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
