#!/usr/bin/env bash
# met-estimator squares where Crouter's equations have an exponential: walking costs 0.4 METs, less than lying still.
#
# Expected: docstrings: the original and the refined Crouter estimation of METs. Crouter et al. (2006): for a coefficient of variation of at
#   most 10 % METs are 2.379833 exp(0.00013529 counts a minute); Crouter et al. (2010): 2.294275 exp(0.00084679 counts in 10 s).
# Seen: the product is squared in place of the exponential. Steady walking at 3000 counts a minute has 0.39 METs for 3.57, by the refined
#   equations 0.41 for 3.50; rest has 1. Up to 4700 counts a minute all steady walking is below rest.
# Hurts: energy expenditure of walking, which is most of a day's: the more steadily one walks, the less it costs.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps met-estimator==0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from met_estimator.METs import c_mets, cr2_mets

rng = np.random.default_rng(1)
seen = {}
for per_minute in (1000, 3000, 5000):
    # Steady walking: counts vary by 3 % from second to second.
    counts = np.round(rng.normal(per_minute / 60, 0.03 * per_minute / 60, 600), 3).tolist()
    original, refined = float(np.mean(c_mets(counts))), float(np.mean(cr2_mets(counts)))
    right = 2.379833 * np.exp(0.00013529 * per_minute), 2.294275 * np.exp(0.00084679 * per_minute / 6)
    seen[per_minute] = original, refined
    print(f"{per_minute} counts a minute: original {original:.2f}, by its equation {right[0]:.2f}; refined {refined:.2f}, {right[1]:.2f}")
print("rest:", float(np.mean(c_mets([0] * 600))), "METs")
print("met-estimator", meta.version("met-estimator"))
still = all(0.9 * 2.379833 * (0.00013529 * c) ** 2 < a < 1.1 * 2.379833 * (0.00013529 * c) ** 2 for c, (a, _) in seen.items())
still &= all(one < 1.3 for pair in seen.values() for one in pair) and seen[3000][1] < 0.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
