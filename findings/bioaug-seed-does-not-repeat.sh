#!/usr/bin/env bash
# bioaug sets numpy's seed from the clock, to one of a hundred: a seeded script does not repeat, and noise does.
#
# Expected: with np.random.seed(1) at the top a script that adds noise with numpy's generator gives the same each time;
#   without, each call's noise is another.
# Seen: GaussianNoise (and six others) seed numpy's global generator with a hash of the time modulo 100. After it the
#   script's own draws, seeded before, differ from run to run; among 400 "independent" noises there are at most a hundred,
#   each of which comes again and again. MixUp seeds it with 42 at each call: each batch is mixed by the same amount and
#   order.
# Hurts: trial orders, simulated responses or cross-validation splits drawn after an augmentation cannot be reproduced, and
#   are among a hundred; augmented EMGs share their noise.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps bioaug==0.1.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import time

import numpy as np
from bioaug.GaussianNoise import GaussianNoise
from bioaug.MixUp import MixUp

emg = np.ones((50, 1))
noises, draws = [], []
for _ in range(400):
    np.random.seed(1)
    noises.append(float(GaussianNoise(p=1.0)(emg)[0, 0]))
    draws.append(float(np.random.rand()))
    time.sleep(0.001)
seen = len(set(noises)), len(set(draws))
print(f"400 times np.random.seed(1), then noise, then a draw: {seen[0]} different noises and {seen[1]} different draws, not one of each")
signals, labels = np.arange(8.0)[:, None, None] * np.ones((8, 5, 1)), np.arange(8.0)
mixed = {tuple(np.round(MixUp(p=1.0)((signals, labels))[1], 6)) for _ in range(20)}
print(f"20 calls of MixUp on a batch: {len(mixed)} different result")
print("bioaug", meta.version("bioaug"))
still = 50 < seen[0] <= 100 and 50 < seen[1] <= 100 and len(mixed) == 1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
