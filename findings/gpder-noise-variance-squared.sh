#!/usr/bin/env bash
# gpder's noise on the points where a model should be certain has the variance as its standard deviation: 3 ms are 9, 0.1 is
#   0.01.
#
# Expected: docstring of minimize_variance: added_noise="gaussian" is "Gaussian with mean 0 and variance gamma^2", gamma the
#   "squared root of the noise variance": with gamma=3 points are moved by 3 on average (its standard deviation).
# Seen: gamma squared is handed to numpy as the standard deviation: 3 moves points by 9, 0.1 by 0.01.
# Hurts: the design (the next inputs to measure) is made for points that are spread three times as far as asked for, or,
#   with gamma below one, hardly at all; and by another factor if the input's unit is changed from s to ms.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gpder==1.0.1 numpy==2.4.6 scipy==1.17.1 scikit-learn==1.9.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from gpder import GaussianProcessRegressor, GPUncertaintyOptimizer, kernels

points = np.linspace(100, 200, 400)[:, None]
train = np.array([[0.0], [150.0], [300.0]])
seen = {}
for gamma in (3.0, 1.0, 0.1):
    model = GaussianProcessRegressor(kernels.RegularKernel(length_scale=30.0), optimizer=None).fit(train, np.sin(train / 30))
    design = GPUncertaintyOptimizer(model, {"isi_ms": (0, 300)}, lambda x: np.sin(x / 30), random_state=1, verbose=False)
    design.minimize_variance(points.copy(), n_iters=1, gamma=gamma, n_restarts_optimizer=0)
    moved = design._X_util_temp - points
    seen[gamma] = float(moved.std() / gamma)
    print(f"gamma {gamma}: points should be moved by a standard deviation of {gamma}; they are by {moved.std():.3f}")
print("gpder", meta.version("gpder"))
still = all(0.9 < ratio / gamma < 1.1 for gamma, ratio in seen.items())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
