#!/usr/bin/env bash
# pyGPGO takes noise for signal at measured points: there the prediction is the measurement and its SD 0, beside it not.
#
# Expected: documentation of the kernels: sigman is the variance of noise in the output. The posterior of the function is smooth,
#   and uncertain where it was measured once, with noise.
# Seen: the noise is part of the kernel wherever two points are equal, thus between a measured point and the same point to be
#   predicted. With a noise of 1 the prediction at each of ten points is its noisy value, with an SD of 0; 0.001 beside it between
#   -0.3 and 0.2, with an SD of 1.1.
# Hurts: the best value seen is a lucky one and is believed; a point is never measured again, as no improvement is expected there,
#   though intensities and ISIs are from a grid.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 joblib==1.5.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pyGPGO==0.5.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pyGPGO.covfunc import squaredExponential
from pyGPGO.surrogates.GaussianProcess import GaussianProcess

at = np.arange(10.0)[:, None]
noise = np.random.default_rng(2).normal(0, 1, 10)
model = GaussianProcess(squaredExponential(l=5.0, sigmaf=1.0, sigman=1.0))
model.fit(at, noise)
seen = {}
for beside in (0.0, 0.001):
    mean, variance = model.predict(at + beside, return_std=True)
    seen[beside] = (np.ravel(mean), np.sqrt(np.abs(np.ravel(variance))))
    print(f"{beside} beside the measured points: {seen[beside][0].round(2).tolist()}, SD up to {seen[beside][1].max():.2f}")
print("measured:", noise.round(2).tolist())
print("pyGPGO", meta.version("pyGPGO"))
still = np.allclose(seen[0.0][0], noise) and seen[0.0][1].max() < 1e-3
still = still and np.abs(seen[0.001][0]).max() < 0.5 and seen[0.001][1].min() > 0.9
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
