#!/usr/bin/env bash
# bayesfit's credible intervals hold probabilities, not values of the parameter, and are meant for 5 %.
#
# Expected: docstring of bci: the Bayesian credible interval of a marginal, for a level of confidence; fitmodel asks for 0.05
#   and stores two bounds for each parameter as BCI, so for a threshold near 4, two values of the threshold around 4.
# Seen: the bounds are entries of the marginal itself (0.0148 and 0.0147 for a threshold of 4), and can be in the wrong
#   order. They stand at 47.5 and 52.5 % of the sum: 5 % of the posterior are between them, not 95 %.
# Hurts: no interval of any fit can be used; in small units (mA, V) the numbers look like very certain thresholds.
# (numpy 1.24 needs a Python before 3.12.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.24.4 scipy==1.10.1 matplotlib==3.7.5 bayesfit==2.4.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import bayesfit
import numpy as np
from bayesfit.extractMetrics import bci

correct = [20, 20, 22, 30, 38, 40, 40]
metrics, _ = bayesfit.fitmodel(np.column_stack((np.arange(1, 8.0), correct, np.full(7, 40))))
low, high = metrics["BCI"][:, 0]
marginal = metrics["Marginals"]["scale"]
print(f"{correct} of 40 at 1 to 7: threshold {metrics['MAP'][0]:.2f}, its interval {low:.5f} to {high:.5f}")
print("both are entries of the marginal:", low in marginal and high in marginal)
falling = np.exp(-np.arange(4000) / 200)
falling /= falling.sum()
places = [int(np.argmin(abs(falling - bound))) for bound in bci(falling, 0.05)]
right = [int(np.argmax(falling.cumsum() >= share)) for share in (0.025, 0.975)]
print(f"a marginal that falls by 1/e in 200 steps, alpha 0.05: the entries at {places}; 95 % are from {right[0]} to {right[1]}")
print("bayesfit", meta.version("bayesfit"))
still = max(low, high) < 0.1 and low in marginal and high in marginal and right[0] + 100 < places[0] < places[1] < 200
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
