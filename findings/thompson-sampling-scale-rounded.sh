#!/usr/bin/env bash
# thompson_sampling rounds the scale of the posterior: after 150 counts it stays, and the rate of the arm grows without end.
#
# Expected: readme: experiments whose response follows a Bernoulli or Poisson distribution; docstring of add_rewards: it updates
#   the posterior distribution, for a Poisson rate a gamma distribution with shape a + sum and scale 1 / (b + n).
# Seen: the scale is rounded to four decimals after each count (eight for exponential outcomes). Below 0.0071 the next count
#   changes it by less than half of the last decimal: it stays, while the shape goes on growing. An arm with a rate of 5 has 5.2
#   after 100 counts, 7.3 after 200 and 35 after 1000.
# Hurts: the arm that was chosen most often seems the best and is chosen for ever; the other's rate of 6 is never reached.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 pandas==3.1.1 matplotlib==3.11.2 seaborn==0.13.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps thompson-sampling==0.0.4
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from thompson_sampling.poisson import PoissonExperiment

generator = np.random.default_rng(1)
outcomes = [int(one) for one in generator.poisson(5, 1000)]
one, total, seen = PoissonExperiment(arms=1, labels=["A"]), 0, {}
for number, outcome in enumerate(outcomes, 1):
    one.add_rewards([{"label": "A", "reward": outcome}])
    total += outcome
    if number in (50, 100, 200, 500, 1000):
        posterior = one.posteriors["A"]
        seen[number] = posterior["shape"] * posterior["scale"], posterior["scale"]
        right = (0.001 + total) / (0.001 + number)
        print(f"{number} counts: mean {seen[number][0]:.2f} for {right:.2f}, scale {seen[number][1]} for {1 / (0.001 + number):.5f}")
both = PoissonExperiment(arms=2, labels=["A", "B"])
both.add_rewards([{"label": "A", "reward": outcome} for outcome in outcomes])
both.add_rewards([{"label": "B", "reward": int(one)} for one in generator.poisson(6, 100)])
chosen = [both.choose_arm() for _ in range(200)].count("A")
print(f"A with a rate of 5 and 1000 counts is chosen in {chosen} of 200 draws before B with 6 and 100 counts")
print("thompson-sampling", meta.version("thompson-sampling"))
still = abs(seen[100][0] - 5) < 0.7 and seen[200][0] > 6 and seen[1000][0] > 25 and seen[500][1] == seen[1000][1] and chosen > 195
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
