#!/usr/bin/env bash
# psychometrics' Best PEST counts earlier trials again at each later level: the estimate depends on the order of the trials.
#
# Expected: Best PEST (Lieberman and Pentland, 1982) gives, after each trial, the most likely threshold by all trials so far. A
#   likelihood is a product over the trials, so the same trials in another order have the same most likely threshold.
# Seen: for each trial the level is stored with the numbers of all trials and all right answers so far, at whatever level, and
#   these are taken for answers at this level. (Hybrid does the same.) Twenty trials at each of three levels give 15.9 to 21.7
#   by their order, for 20.4.
# Hurts: thresholds of adaptive sessions: the levels come in an order that follows the answers, and the next level is made of
#   the wrong estimate; in simulations with a threshold of 20 sessions ended at 15, 17 and 36.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 matplotlib==3.10.8 psychometrics==0.1.2
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
from itertools import permutations

import numpy as np
from psychometrics.BestPEST import BestPEST

SLOPE, CHANCE = 3.0, 0.5
trials = {17: [1] * 12 + [0] * 8, 20: [1] * 15 + [0] * 5, 23: [1] * 17 + [0] * 3}
thresholds = np.linspace(0, 60, 60_001)
likelihood = np.zeros(thresholds.size)
for level, answers in trials.items():
    share = CHANCE + (1 - CHANCE) / (1 + np.exp(-(level - thresholds) / SLOPE))
    likelihood += sum(answers) * np.log(share) + (len(answers) - sum(answers)) * np.log(1 - share)
right = thresholds[likelihood.argmax()]
found = []
for order in permutations(trials):
    pest = BestPEST(init_M=20.0, init_S=SLOPE, a=1 - CHANCE, b=CHANCE, T_end=60)
    for level in order:
        for answer in sorted(trials[level], reverse=True):
            estimate = pest.update(bool(answer), float(level))
    found.append(float(estimate))
    print(f"levels {order}: {estimate:.2f}; the most likely threshold is {right:.2f} in any order")
print("psychometrics", meta.version("psychometrics"))
still = max(found) - min(found) > 2 and max(abs(value - right) for value in found) > 2
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
