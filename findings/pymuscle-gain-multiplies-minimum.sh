#!/usr/bin/env bash
# pymuscle multiplies the minimum firing rate by the gain, too: at a gain of 2 a unit begins at 16 Hz, not at 8.
#
# Expected: docstring of PotvinFuglevand2017MotorNeuronPool: firing_gain is the slope of the rate by the excitation above
#   threshold, min_firing_rate the rate at threshold; in the model (Fuglevand 1993, Potvin and Fuglevand 2017) the rate is
#   gain x (excitation - threshold) + minimum.
# Seen: the rate is gain x (excitation - threshold + minimum). At a gain of 1 it is the same; at 2 a unit at threshold fires
#   at 16 Hz, at 0.5 at 4 Hz, below the stated minimum.
# Hurts: whoever fits or varies the gain changes the rate at recruitment with it: forces, and the EMG simulated from the
#   rates, are those of another pool.
# (plotly, which draws only, is not installed.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pymuscle==0.1.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pymuscle import PotvinFuglevand2017MotorNeuronPool

UNITS, MINIMUM = 120, 8
threshold = np.exp(np.log(50) * np.arange(UNITS) / (UNITS - 1))
seen = {}
for gain in (1.0, 2.0, 0.5):
    pool = PotvinFuglevand2017MotorNeuronPool(UNITS, firing_gain=gain, min_firing_rate=MINIMUM, apply_fatigue=False)
    unit = 60
    rates = [float(pool.step(np.full(UNITS, threshold[unit] + above), 0.02)[unit]) for above in (0.001, 4.0)]
    seen[gain] = [round(rate, 1) for rate in rates]
    print(f"gain {gain:g}: at threshold by the model {MINIMUM} Hz, pymuscle {rates[0]:.1f} Hz; 4 above it {gain * 4 + MINIMUM:g} Hz, pymuscle {rates[1]:.1f} Hz")
print("pymuscle", meta.version("pymuscle"))
still = seen == {1.0: [8.0, 12.0], 2.0: [16.0, 24.0], 0.5: [4.0, 6.0]}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
