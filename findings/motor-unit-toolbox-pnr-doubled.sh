#!/usr/bin/env bash
# motor-unit-toolbox's pulse-to-noise ratio is twice as many decibels as its own definition says: 20 dB are 40 dB.
#
# Expected: docstring of get_pulse_to_noise_ratio: 20 log10 of the mean of the pulse train at the spikes over its mean at the
#   baseline; find_reliable_units keeps units with 30 dB and more, the usual limit of the field.
# Seen: both means are of the pulse train's squares, and the factor stays 20. A train of ten at the spikes and one
#   between them has 40 dB, one of 6 and 1 has 31 dB and is kept.
# Hurts: the limit of 30 dB is one of 15 dB: units from a poor decomposition are kept, and reported ratios cannot be compared with
#   other programs'.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    motor-unit-toolbox==1.2.0 numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 scikit-learn==1.9.1 matplotlib==3.11.2 \
    seaborn==0.13.2 networkx==3.6.1 easydict==1.14
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import motor_unit_toolbox.props as props
import numpy as np

rng = np.random.default_rng(1)
samples = 40960
train = np.zeros((samples, 1), int)
train[100::200] = 1
seen = {}
for height in (3.0, 6.0, 10.0):
    pulses = np.where(np.arange(samples) % 2, 1.0, 0.5)  # peaks of 1 between the spikes
    at = np.flatnonzero(train[:, 0])
    pulses[at] = height * rng.uniform(0.99, 1.01, at.size)
    pulses = pulses[:, None]
    stated = float(props.get_pulse_to_noise_ratio(train, pulses)[0])
    defined = 20 * np.log10(pulses[at].mean() / 1.0)
    kept = props.find_reliable_units(np.array([10.0]), np.array([0.2]), np.array([0.95]), np.array([stated]))
    seen[height] = (round(stated / defined, 2), bool(kept[0]))
    print(f"spikes of {height:g}, baseline of 1: by the definition {defined:.1f} dB, stated {stated:.1f} dB, kept {kept[0]}")
print("motor-unit-toolbox", meta.version("motor_unit_toolbox"))
still = all(1.9 < ratio < 2.05 for ratio, _ in seen.values()) and [kept for _, kept in seen.values()] == [False, True, True]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
