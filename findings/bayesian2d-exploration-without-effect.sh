#!/usr/bin/env bash
# Bayesian2D's exploration constant has no effect: every value asks for the same next point.
#
# Expected: its documentation: the user specifies, among others, "the exploration constant" (default 0.2); in the probability of
#   improvement it is subtracted from the difference to the best value before this is divided by the standard deviation, so that
#   uncertain points win as it grows.
# Seen: it is subtracted after the division, equally from all points, and only their order is used: 0, 0.2, 1 and 3 ask for the
#   same point in each of 20 starts, looking for the minimum and for the maximum; by the formula most of them are other ones.
# Hurts: who raises it because a search has got stuck at a local optimum gets the same search again.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 scikit-learn==1.9.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps Bayesian2D==0.3.1
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from Bayesian2D.Bayesian2D_scr import acquisition, create_random, functions
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import Matern

BOUNDS, CONSTANTS = (-2, 2), (0, 0.2, 1, 3)
asked, others = [], []
for seed in range(20):
    for what, sign in (("minimum", -1), ("maximum", 1)):
        np.random.seed(seed)
        points = create_random(BOUNDS, BOUNDS, 25)
        values = np.log(1 + functions(points[:, 0], points[:, 1], "Rosenbrock"))
        model = GaussianProcessRegressor(kernel=Matern(), alpha=1e-6).fit(points, values)
        next_points, by_formula = set(), set()
        for constant in CONSTANTS:
            np.random.seed(seed)
            next_points.add(acquisition(points, BOUNDS, BOUNDS, constant, model, what, 2000))
            np.random.seed(seed)
            candidates = create_random(BOUNDS, BOUNDS, 2000)
            mean, deviation = model.predict(candidates, return_std=True)
            best = (sign * model.predict(points)).max()
            by_formula.add(int(np.argmax((sign * mean - best - constant) / (deviation + 1e-9))))
        asked.append(len(next_points))
        others.append(len(by_formula))
print(f"different points asked for with the constants {CONSTANTS}: at most {max(asked)} in {len(asked)} searches")
print(f"by the formula: more than one in {sum(number > 1 for number in others)} of {len(others)}")
print("Bayesian2D", meta.version("Bayesian2D"))
still = max(asked) == 1 and sum(number > 1 for number in others) > 10
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
