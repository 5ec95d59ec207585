#!/usr/bin/env bash
# motor-unit-toolbox counts firings where it should count intervals: a unit that fires in pairs at 10 Hz fires at 20 Hz.
#
# Expected: docstring of get_discharge_rate: the discharge rate of motor units; the code says that what is longer than
#   250 ms between two firings is a silent period and left out. A unit with 100 ms between its firings has 10 Hz.
# Seen: the number of firings is divided by the sum of the intervals that are left, of which each burst has one less than
#   firings: bursts of three at 10 Hz make 15 Hz, pairs 20 Hz. Without pauses it is right but for one firing.
# Hurts: weak or intermittent contractions, and tremor: their units seem to fire faster, the more so the shorter each burst
#   is, and a change of bursts' length looks like a change of rate.
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

RATE = 2000
time = np.arange(20 * RATE) / RATE
seen = []
for firings, every_s in ((200, 20), (10, 2), (3, 2), (2, 2)):
    train = np.zeros((time.size, 1), int)
    for start in range(0, 20, every_s):
        train[np.round((start + 0.1 * np.arange(firings)) * RATE).astype(int)] = 1
    median_ms = 1000 * np.median(np.diff(time[train[:, 0] == 1]))
    seen.append(round(float(props.get_discharge_rate(train, time)[0]), 1))
    print(f"bursts of {firings} firings, {median_ms:.0f} ms apart: {seen[-1]} Hz")
print("motor-unit-toolbox", meta.version("motor_unit_toolbox"))
still = seen == [10.1, 11.1, 15.0, 20.0]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
