#!/usr/bin/env bash
# physiodsp's step counter calls each bout walking: running at 168 steps a minute is a bout of "walk".
#
# Expected: docstring of StepBout: activity is "walk" or "run"; windows with a cadence above 2.2 Hz are classified as running, and the
#   biomarker's activity_state says so.
# Seen: before the bouts are made the activity of every step is set to "walk". A minute at 2.8 Hz has the state "run" in each second, a
#   cadence of 168, and one bout of "walk".
# Hurts: minutes of running and of walking a day: all are walking.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 pydantic==2.9.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps physiodsp==0.2.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from physiodsp.activity.step_count import StepCount
from physiodsp.sensors.imu.accelerometer import AccelerometerData

RATE = 50
time = np.arange(60 * RATE) / RATE
seen = {}
for cadence_hz in (1.8, 2.8):
    z = 1 + 0.4 * np.sin(2 * np.pi * cadence_hz * time)
    data = AccelerometerData(timestamps=time, x=np.zeros_like(z), y=np.zeros_like(z), z=z, fs=RATE)
    result = StepCount().run(data)
    states = result.biomarker["activity_state"].value_counts().to_dict()
    bouts = [(bout.activity, round(bout.mean_cadence_spm)) for bout in result.bouts]
    seen[cadence_hz] = max(states, key=states.get), bouts
    print(f"{cadence_hz * 60:.0f} steps a minute: seconds {states}, bouts {bouts}")
print("physiodsp", meta.version("physiodsp"))
still = seen[1.8][0] == "walk" and seen[2.8][0] == "run" and [bout[0] for bout in seen[2.8][1]] == ["walk"] and seen[2.8][1][0][1] > 150
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
