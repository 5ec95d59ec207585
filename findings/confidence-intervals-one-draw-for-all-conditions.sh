#!/usr/bin/env bash
# confidence-intervals draws the same trials in every person: a trend within a session is five times as uncertain.
#
# Expected: docstring of get_bootstrap_indices: conditions (say, persons) are sampled first, then the samples of each chosen one;
#   persons are independent of each other.
# Seen: one seed serves all conditions of a resample, so that those of one size get the same positions: whoever has trial 3 twice
#   has it twice with all. Of 30 persons whose 12 trials rise from 0 to 11 the mean of 5.5 has 3.7 to 7.3; drawn apart 5.1 to 5.9.
# Hurts: intervals of sessions with habituation, fatigue or a fixed order of conditions are far too wide, and a difference that is
#   there is missed.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.0.2 scipy==1.15.3 scikit-learn==1.9.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps confidence-intervals==0.0.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from confidence_intervals import Bootstrap, get_bootstrap_indices

PERSONS, TRIALS = 30, 12
person = np.repeat(np.arange(PERSONS), TRIALS)
value = np.tile(np.arange(float(TRIALS)), PERSONS)
drawn = get_bootstrap_indices(value.size, person, random_state=5).reshape(-1, TRIALS) % TRIALS
low, high = Bootstrap(500, np.mean).get_conf_int(value, None, person)
rng = np.random.default_rng(0)
apart = [
    np.mean([value[one * TRIALS + rng.integers(0, TRIALS, TRIALS)] for one in rng.integers(0, PERSONS, PERSONS)])
    for _ in range(500)
]
other = np.percentile(apart, [2.5, 97.5])
print("trials drawn in the first two persons of a resample:", drawn[0].tolist(), drawn[1].tolist())
print(f"mean {value.mean()}: interval {low:.2f} to {high:.2f}; persons drawn apart {other[0]:.2f} to {other[1]:.2f}")
print("confidence-intervals", meta.version("confidence-intervals"))
still = set(drawn.ravel().tolist()) == set(drawn[0].tolist()) and high - low > 3 * (other[1] - other[0])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
