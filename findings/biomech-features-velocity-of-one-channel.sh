#!/usr/bin/env bash
# biomech-features states a conduction velocity for one channel: it is the electrode distance times the EMG's main
#   frequency.
#
# Expected: docstring of estimate_conduction_velocity: muscle fibre conduction velocity; by its definition the distance of
#   two electrodes by the delay between them, which is not in one channel. Two EMGs that are equal are not distinguishable.
# Seen: the delay is that of the first peak of the channel's own autocorrelation. Potentials of 240 Hz have 2.44 m/s whether
#   they travel at 2, 4 or 6 m/s, those of 120 Hz half of that. Values outside 1 to 10 m/s are left out, so that the rest
#   looks plausible.
# Hurts: it is offered as a sign of fatigue: it does fall then, with the spectrum, of which it is another name; no electrode
#   distance nor second channel enters.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    biomech-features==0.1.1 numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from biomechfe.Featureset.EMG_statistical_features import estimate_conduction_velocity

RATE, DISTANCE_MM = 10_000, 10
seen = []
for velocity, frequency in ((4, 120), (4, 240), (2, 240), (6, 240)):
    times = np.arange(-100, 101) / RATE
    potential = np.cos(2 * np.pi * frequency * times) * np.exp(-0.5 * (times * 150) ** 2)
    train = np.zeros(20_000)
    train[np.cumsum(np.random.default_rng(1).integers(700, 1300, 18))] = 1
    first = np.convolve(train, potential, "same")
    second = np.roll(first, round(DISTANCE_MM / velocity / 1000 * RATE))
    lags = np.arange(1, 80)
    delay_s = lags[np.argmax([np.dot(first[:-lag], second[lag:]) for lag in lags])] / RATE
    by_delay = DISTANCE_MM / 1000 / delay_s
    seen.append([round(float(estimate_conduction_velocity(channel, RATE, DISTANCE_MM)), 2) for channel in (first, second)])
    print(f"{velocity} m/s, potentials of {frequency} Hz: by the delay of two electrodes {by_delay:.2f} m/s, stated for each {seen[-1]}")
print("biomech-features", meta.version("biomech-features"))
still = seen[1] == seen[2] == seen[3] and 1.7 < seen[1][0] / seen[0][0] < 2.3
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
