#!/usr/bin/env bash
# gpie's Bayesian optimiser asks next where the least improvement is expected: its default searches no better than at
#   random.
#
# Expected: "expected improvement" (acquisition="ei", the default) is largest where the next evaluation is worth most, and
#   the optimiser asks there; it is (y_min - m) Phi(z) + s phi(z), z = (y_min - m) / s.
# Seen: the minimum of each acquisition is taken, which is right for the lower confidence bound ("lcb") only: "ei" and "pi"
#   ask where improvement is least, and if that is a point already asked for, as it mostly is, at a random one. The second
#   term lacks the s. After three evaluations of a parabola a third of all points has more expected improvement than the one
#   that is asked for, about as for a random one; with "lcb" it is none.
# Hurts: every search or design with the default: stimuli are spent where nothing is to be gained; nothing is raised (a
#   warning "turn to pure exploration" comes each time, in "lcb" too).
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gpie==0.2.2 numpy==1.26.4 scipy==1.14.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from gpie.base import Bounds
from gpie.kernel import BayesianOptimizer, GaussianProcessRegressor, RBFKernel, WhiteKernel
from scipy.stats import norm

grid = np.linspace(0, 10, 201)
asked, above, at_random = {}, {}, []
for acquisition in ("ei", "lcb"):
    asked[acquisition], above[acquisition] = [], []
    for seed in range(10):
        np.random.seed(seed)
        search = BayesianOptimizer(
            lambda x: float((x[0] - 3) ** 2), Bounds(np.array([0.0]), np.array([10.0])), np.array([[0.5], [4.0], [6.0]]), n_evals=4,
            acquisition=acquisition, surrogate=GaussianProcessRegressor(1.0 * RBFKernel(2.0) + 1.0 * WhiteKernel()),
        )
        search._fit()
        predicted = search.surrogate.posterior_predictive(np.append(grid, 0)[:, None])
        best = search.y.min()
        search._update()
        next_x = float(search.X[-1, 0])
        mean, sd = predicted.mu[:-1], np.sqrt(np.diag(predicted.cov))[:-1]
        z = (best - mean) / sd
        improvement = (best - mean) * norm.cdf(z) + sd * norm.pdf(z)
        at_next = np.interp(next_x, grid, improvement)
        asked[acquisition].append(round(next_x, 1))
        above[acquisition].append(float(np.mean(improvement > at_next + 1e-9)))
        at_random.append(float(np.mean(improvement[:, None] > improvement + 1e-9)))
    print(f"{acquisition}: asked next at {asked[acquisition]}; on average {100 * np.mean(above[acquisition]):.0f} % of points have more expected improvement")
print(f"of a random point it is {100 * np.mean(at_random):.0f} %")
print("gpie", meta.version("gpie"))
still = np.mean(above["ei"]) > 0.15 and np.mean(above["lcb"]) < 0.02
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
