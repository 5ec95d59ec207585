#!/usr/bin/env bash
# psihope's sampler with a seed begins with other particles and stimuli each time.
#
# Expected: docstring of HopeSampler: seed is that of its random generator; README: a seed is given to the sampler and none to
#   the model. Two samplers with the same seed, model and pool ask for the same stimuli.
# Seen: the particles are drawn by the model from its own seed, which is None unless it is given there, too. Two samplers
#   with seed 7 have other particles, and begin with other stimuli in some pairs.
# Hurts: a session or a simulation cannot be run again, although its script and its log state a seed; differences between two
#   variants of a method that are simulated "with the same seed" are partly those of other particles.
# (psihope is installed without torch, which neither the prior nor the first stimulus needs.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps psihope==0.1.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
from unittest.mock import MagicMock

import numpy as np
import scipy.stats

for name in ("torch", "torch.distributed.flight_recorder.components.types", "torch.distributions.multivariate_normal"):
    sys.modules[name] = MagicMock()
from hope import HopeSampler
from hope.psychometric_model import BinaryPsychometricModel


def chance(stimuli, parameters):
    threshold, slope = parameters[:, :1], parameters[:, 1:]
    return 1 / (1 + np.exp(-slope * (np.atleast_2d(stimuli)[:, 0] - threshold)))


priors = {"threshold": scipy.stats.norm(50, 8), "slope": scipy.stats.uniform(0.05, 0.95)}
pool = np.arange(30.0, 71.0)[:, None]
seen = {}
for model_seed in (None, 1):
    model = BinaryPsychometricModel(chance, priors, seed=model_seed)
    samplers = [HopeSampler(model, pool, n_particles=1000, seed=7) for _ in range(8)]
    means = [float(sampler.particles.locations[:, 0].mean()) for sampler in samplers]
    first = [float(sampler.get_next_stimulus()[0]) for sampler in samplers]
    seen[model_seed] = (len(set(means)), len(set(first)))
    print(f"eight samplers with seed=7, model's seed {model_seed}: mean thresholds {np.round(means, 2).tolist()}, first stimuli {first}")
print("psihope", meta.version("psihope"))
still = seen[None][0] == 8 and seen[None][1] > 1 and seen[1] == (1, 1)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
