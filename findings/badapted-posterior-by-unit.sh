#!/usr/bin/env bash
# badapted moves its particles by 2 of whatever unit: in ms it is twice as sure as it may be, in coarser units than s one is left.
#
# Expected: docstring of update_beliefs: the particles represent the posterior; the walk is scaled by scale_walk_factor, and the code
#   means it to be times the particles' SD where there are several parameters. The unit of a threshold changes nothing.
# Seen: the question whether there are several is always answered alike, and the step is 2. A threshold with an exact posterior SD
#   of 9.9 ms after 30 trials has one of 9.7 ms if times are in s, 5.9 in ms, 1.5 in tenths of ms, since steps that are small
#   against the posterior weight it again each time; in minutes one of 3000 particles is left.
# Hurts: adaptive sessions in ms, Hz or per cent: the next stimulus is chosen, and the answer given, with a certainty that is not there.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps badapted==0.0.3
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from badapted.choice_functions import StandardCumulativeNormalChoiceFunc
from badapted.model import Model
from scipy.stats import norm


class Threshold(Model):
    """A yes-or-no threshold, 100 +- 50 ms before the session; `per_s` is how many of the unit are in a second."""

    def __init__(self, per_s):
        self.n_particles, self.per_s, self.θ_fixed = 3000, per_s, {"ϵ": 0.01}
        self.prior = {"threshold": norm(0.1 * per_s, 0.05 * per_s)}

    def predictive_y(self, θ, data):
        return StandardCumulativeNormalChoiceFunc((data["x"].values - θ["threshold"].values) / (0.02 * self.per_s), θ, self.θ_fixed)


np.random.seed(1)
stimuli = np.random.uniform(0, 0.2, 30)
answers = (np.random.rand(30) < 0.01 + 0.98 * norm.cdf((stimuli - 0.12) / 0.02)).astype(int)
grid = np.linspace(-0.2, 0.4, 6001)
chance = 0.01 + 0.98 * norm.cdf((stimuli[:, None] - grid) / 0.02)
log = norm.logpdf(grid, 0.1, 0.05) + np.log(np.where(answers[:, None], chance, 1 - chance)).sum(axis=0)
weights = np.exp(log - log.max()) / np.exp(log - log.max()).sum()
exact = np.sqrt((weights * (grid - (weights * grid).sum()) ** 2).sum())
print(f"exact posterior SD after 30 trials: {1000 * exact:.2f} ms")
seen = {}
for name, per_s in (("s", 1), ("ms", 1000), ("tenths of ms", 10000), ("minutes", 1 / 60)):
    model = Threshold(per_s)
    for number in (1, 5, 10, 20, 30):
        model.update_beliefs(pd.DataFrame({"x": stimuli[:number] * per_s, "R": answers[:number]}))
    values = model.θ["threshold"] / per_s
    seen[name] = float(values.std()) / exact
    print(f"in {name}: SD {1000 * values.std():.2f} ms, {seen[name]:.2f} of the exact one; {values.nunique()} different particles")
print("badapted", meta.version("badapted"))
still = 0.85 < seen["s"] < 1.15 and seen["ms"] < 0.8 and seen["tenths of ms"] < 0.25 and seen["minutes"] < 0.05
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
