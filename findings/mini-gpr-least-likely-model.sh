#!/usr/bin/env bash
# mini-gpr's objective by the likelihood of held-out data looks for the model that is least likely.
#
# Expected: documentation of Objective: "a lower value is a better model"; optimise_model minimises it. The objective by a
#   validation set's log likelihood is then its negative, as is that of maximise_log_likelihood beside it.
# Seen: the log likelihood itself is returned, so that the optimiser makes it as small as it can. From a length scale of 1,
#   which is the true one, it goes to one that explains nothing: the held-out data's log likelihood falls from 30 to -797,
#   where the same search with the sign turned rises to 32.
# Hurts: whoever chooses length scales, or the noise, by held-out trials gets the worst ones; predictions look smooth or
#   flat, and nothing is raised.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps mini-gpr==0.0.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 jaxtyping==0.3.11
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from mini_gpr.kernels import RBF
from mini_gpr.models import GPR
from mini_gpr.opt import optimise_model, validation_set_log_likelihood

rng = np.random.default_rng(1)
x = rng.uniform(0, 10, (80, 1))
y = np.sin(x[:, 0]) + 0.1 * rng.normal(size=80)
train, held_out = (x[:40], y[:40]), (x[40:], y[40:])
stated = validation_set_log_likelihood(*held_out)
start = GPR(RBF(sigma=1.0, scale=1.0), noise=0.1)
start.fit(*train)
seen = [stated(start)]
for name, objective in (("as it is", stated), ("with its sign turned", lambda model: -stated(model))):
    best = optimise_model(GPR(RBF(sigma=1.0, scale=1.0), noise=0.1), objective, *train)
    seen.append(stated(best))
    print(f"objective {name}: {best.kernel}, held-out log likelihood from {seen[0]:.1f} to {seen[-1]:.1f}")
print("mini-gpr", meta.version("mini-gpr"))
still = seen[0] > 20 and seen[1] < 0 and seen[2] >= seen[0] - 0.1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
