#!/usr/bin/env bash
# psihope draws all parameters of the prior from one seed: threshold and slope are correlated by 1.
#
# Expected: docstring of sample_prior: samples from the joint prior, of priors that are named one by one; log_prior of the same
#   class adds their logarithms, so that they are independent. A seed makes the samples repeatable.
# Seen: with a seed each prior is sampled with a generator made anew from that seed. Priors of one family get the
#   same random numbers: two uniform or two normal priors have a correlation of 1.00, all particles lie on one line.
#   Without a seed it is 0.
# Hurts: the first stimuli, and all evidence of the first trials, are of a prior that has no steep curve with a high
#   threshold and a low one with a flat curve, or the other way round; studies use a seed to be repeatable.
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


pool = np.arange(30.0, 71.0)[:, None]
families = {
    "uniform": {"threshold": scipy.stats.uniform(30, 40), "slope": scipy.stats.uniform(0.05, 0.95)},
    "normal": {"threshold": scipy.stats.norm(50, 8), "slope": scipy.stats.norm(0.5, 0.1)},
}
seen = {}
for family, priors in families.items():
    for seed in (None, 1):
        model = BinaryPsychometricModel(chance, priors, seed=seed)
        seen[family, seed] = round(float(np.corrcoef(model.sample_prior(2000).T)[0, 1]), 2)
        first = [float(HopeSampler(model, pool, n_particles=4000).get_next_stimulus()[0]) for _ in range(5)]
        print(f"{family} priors, seed={seed}: correlation {seen[family, seed]:.2f}, first stimulus in five sessions {first}")
print("psihope", meta.version("psihope"), "scipy", meta.version("scipy"))
still = all((value == 1.0) if seed == 1 else abs(value) < 0.1 for (_, seed), value in seen.items())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
