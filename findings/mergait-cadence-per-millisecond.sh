#!/usr/bin/env bash
# mergait's cadence is sixty divided by milliseconds: running at 180 steps a minute is 0.18.
#
# Expected: docstring of gait_features_from_vertical_acceleration: cadence in steps per minute, derived from step_duration.
# Seen: the step's duration is in milliseconds (its limits are, too), and cadence is 60 divided by it: 0.18 for steps of 333 ms. That is
#   a thousandth, and no unit's.
# Hurts: tables in which the cadence of the phone stands beside that of foot pods: one of them is a thousand times the other.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps mergait==0.0.8
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import logging

import numpy as np
import pandas as pd
from mergait.imu import gait_features_from_vertical_acceleration

logging.disable()
seen = {}
for steps in (160, 180):
    seconds = np.arange(0, 20, 0.01)
    timestamps = pd.Series((seconds * 1e9).astype("int64"))
    vertical = pd.Series(3 * np.sin(2 * np.pi * steps / 60 * seconds))
    features, *_ = gait_features_from_vertical_acceleration(timestamps, vertical)
    seen[steps] = float(features["step_duration"].median()), float(features["cadence"].median())
    print(f"{steps} steps a minute: step duration {seen[steps][0]:.0f}, cadence {seen[steps][1]:.3f}; 60000 / {seen[steps][0]:.0f} is {60000 / seen[steps][0]:.0f}")
print("mergait", meta.version("mergait"))
still = all(abs(60000 / duration - steps) < 6 and abs(cadence - steps / 1000) < 0.006 for steps, (duration, cadence) in seen.items())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
