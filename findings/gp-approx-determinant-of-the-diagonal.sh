#!/usr/bin/env bash
# gp-approx's "exact" moments of a Gaussian process for uncertain inputs take the diagonal's product for the determinant.
#
# Expected: docstring of gp_EM: a Gaussian process with exact moment matching, for inputs with a mean and a covariance X_covar: the mean
#   and variance of the prediction are those of many samples of the input.
# Seen: the determinant is made of the logarithms of the matrix's elements: [[1, 0.9], [0.9, 1]] has 1 instead of 0.19. With
#   independent inputs mean and variance are right; with a correlation of 0.9 the variance is 0.26 for 0.07.
# Hurts: uncertainty that is handed on through a model (intensity and angle of a coil, for instance, which vary together).
# (Needs a Python before 3.12, as it needs a numpy before 2.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.11.4 pandas==1.5.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps gp-approx==1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import pathlib
import sys

import numpy as np

# The modules import each other as if from their own folder.
sys.path.insert(0, str(next(pathlib.Path(sys.prefix).glob("lib/*/site-packages/functions"))))
from gp_functions import determinant, gp, gp_EM

rng = np.random.default_rng(1)
inputs = rng.uniform(-3, 3, (60, 2))
outputs = np.exp(-0.5 * (inputs**2).sum(axis=1, keepdims=True)) + 0.5 * inputs[:, :1]
hyper = np.array([[1.2, 1.2, 1.5, 0.05]])
squares = ((inputs[:, None] - inputs[None]) ** 2 / 1.2**2).sum(axis=2)
inverse = np.linalg.inv(1.5**2 * np.exp(-0.5 * squares) + 0.05**2 * np.eye(60))[None]
alpha = np.array([inverse[0] @ outputs[:, 0]])
print(f"determinant of [[1, 0.9], [0.9, 1]]: {determinant(np.array([[1, 0.9], [0.9, 1]])):.2f}, by numpy {np.linalg.det([[1, 0.9], [0.9, 1]]):.2f}")
centre, seen = np.array([[0.8, 0.4]]), {}
for correlation in (0, 0.9):
    covariance = 0.6 * np.array([[1, correlation], [correlation, 1]])
    drawn = [gp(inputs, outputs, one[None], inverse, hyper, alpha) for one in rng.multivariate_normal(centre[0], covariance, 3000)]
    means, variances = np.array(drawn)[:, :, 0, 0].T
    found = [float(np.squeeze(part)) for part in gp_EM(inputs, outputs, centre, covariance, inverse, hyper, alpha)]
    seen[correlation] = means.mean(), variances.mean() + means.var(), *found
    print(
        f"correlation {correlation}: mean of the samples {seen[correlation][0]:.2f}, found {found[0]:.2f}; "
        f"variance {seen[correlation][1]:.2f}, found {found[1]:.2f}"
    )
print("gp-approx", meta.version("gp-approx"))
still = np.allclose(seen[0][:2], seen[0][2:], atol=0.03) and seen[0.9][3] > 2.5 * seen[0.9][1]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
