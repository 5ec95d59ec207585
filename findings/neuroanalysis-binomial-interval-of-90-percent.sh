#!/usr/bin/env bash
# neuroanalysis' binomial intervals are of 90 % for 95: 0 of 20 cannot be zero, and 20 of 20 has none.
#
# Expected: docstrings of binomial_ci and binomial_sliding_window: alpha=0.05 gives the 95 % interval. It holds 0 when nothing was
#   found, and has a lower limit when all were (Clopper and Pearson: 0 to 0.17, and 0.83 to 1).
# Seen: each end leaves out alpha, not half of it, and the lower end takes the wrong tail. 0 of 20 has 0.003 to 0.14, 20 of 20 nan
#   to nan, 6 of 20 0.18 to 0.51 for 0.12 to 0.54. (Trials and successes are also named the other way round.)
# Hurts: connection or response probabilities by distance: where nothing was found zero is excluded, and differences look certain
#   that are not.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps neuroanalysis==0.0.7
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from neuroanalysis.stats import binomial_sliding_window
from scipy.stats import binomtest

seen = {}
for found in (0, 6, 20):
    at = np.full(20, 50e-6)  # 20 pairs 50 um apart
    _, share, low, high = binomial_sliding_window(at, np.arange(20) < found, window=100e-6, spacing=500e-6, alpha=0.05)
    exact = binomtest(found, 20).proportion_ci(0.95, "exact")
    seen[found] = (round(float(low[0]), 4), round(float(high[0]), 4))
    print(f"{found} of 20: {share[0]:.2f}, interval {seen[found]}; exact 95 %: {exact.low:.4f} to {exact.high:.4f}")
print("neuroanalysis", meta.version("neuroanalysis"))
still = seen[0] == (0.0026, 0.1391) and seen[6] == (0.1773, 0.5078) and all(np.isnan(seen[20]))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
