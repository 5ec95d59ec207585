#!/usr/bin/env bash
# physiodsp drops the last window of a recording: ten seconds of ENMO are nine, and a minute's last second is never seen.
#
# Expected: docstring of ENMO.run: the average of ENMO over non-overlapping windows of window_len seconds, so ten of them in ten seconds.
# Seen: a window's value stands at the sample behind it, which the last window does not have. Ten seconds have nine values, one second has
#   none; a movement in the last second is not in any. So it is in the zero crossings and the time above a threshold.
# Hurts: with windows of 60 s the last minute of each file; of files of one window all is lost.
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
from physiodsp.activity.enmo import ENMO, ENMOSettings
from physiodsp.sensors.imu.accelerometer import AccelerometerData

RATE = 50


def windows(seconds, length):
    time = np.arange(seconds * RATE) / RATE
    z = np.where(time >= seconds - length, 1.5, 1.0)  # a movement in the last window
    data = AccelerometerData(timestamps=time, x=np.zeros_like(z), y=np.zeros_like(z), z=z, fs=RATE)
    return ENMO(ENMOSettings(window_len=length)).run(data).biomarker["values"].round(3).tolist()


seen = {}
for seconds, length in ((10, 1), (1, 1), (120, 60)):
    seen[seconds] = windows(seconds, length)
    print(f"{seconds} s in windows of {length} s, 0.5 g in the last: {seen[seconds]}")
print("physiodsp", meta.version("physiodsp"))
still = seen == {10: [0.0] * 9, 1: [], 120: [0.0]}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
