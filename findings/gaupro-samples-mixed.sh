#!/usr/bin/env bash
# gaupro's samples of a Gaussian process mix the points: each has the mean of all; the normal distribution function is another.
#
# Expected: pick_samples draws sample paths of the fitted process, one column for each, one row for each test point: near the
#   data all paths go through them. PI is the probability of improvement, so it uses the normal distribution function.
# Seen: the paths are reshaped, not transposed: at noise-free data of 0, 10, 20 and 30 every row has a mean of 15 and an SD of
#   11. utils.normal_cdf divides by 2 squared where the root of 2 belongs: 1.96 SD are 0.756, not 0.975; and PI divides the
#   improvement by the variance, not by the SD.
# Hurts: simulations, uncertainty bands and Thompson sampling from such paths; an optimiser that ranks points by other
#   probabilities than it says.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check setuptools==80.9.0 numpy==2.4.6 gaupro==0.2.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from gaupro.acquisition_functions import PI
from gaupro.kernels import se_kernel
from gaupro.Regressor import Regressor
from gaupro.utils import normal_cdf

data = np.array([[0.0, 1, 2, 3]]), np.array([[0.0], [10], [20], [30]])
model = Regressor(se_kernel(), sigma_n=0.01)
model.fit(*data)
model.predict(data[0])
np.random.seed(1)
paths = model.pick_samples(2000)
right = np.random.multivariate_normal(model.mu[:, 0], model.cov, 2000).T
for case, rows in (("gaupro's", paths), ("drawn here", right)):
    print(f"paths {case} {rows.shape}: mean at the data {rows.mean(1).round(2)}, SD {rows.std(1).round(3)}")
cdf = normal_cdf(np.array([-1.96, 0, 1.96]))
gain = PI(0)(np.array([[0.0], [0.1]]), np.diag([0.04, 0.04]))[0, 0]
print(f"normal distribution function at -1.96, 0 and 1.96: {cdf.round(3)}")
print(f"0.1 below the best with an SD of 0.2, half an SD: {gain:.3f} for 0.309")
print("gaupro", meta.version("gaupro"))
still = paths.shape == (4, 2000) and np.allclose(paths.mean(1), 15, atol=1) and bool((paths.std(1) > 9).all())
still &= np.allclose(right.mean(1), data[1][:, 0], atol=0.01) and np.allclose(cdf, [0.244, 0.5, 0.756], atol=1e-3)
still &= np.isclose(gain, normal_cdf(np.array([-0.1 / 0.04]))[0])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
