#!/usr/bin/env bash
# pyibt's slopes of a part of a sweep are those of the whole sweep: what is asked for at 0.6 s begins at 0.
#
# Expected: get_dVdt(start, duration) takes the same arguments as get_data and get_time beside it and gives the slope of that part.
# Seen: both arguments are checked and not used. Of a sweep of 1 s whose voltage rises by 1 mV a ms in the last half, 100 ms from
#   0.6 s have 10000 slopes, the first ones 0, for 1000 of 1.
# Hurts: action potentials during a current step: slopes of the time before it are laid on the step's times, and the largest one is
#   from elsewhere.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pyibt==0.0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import struct
import sys

import numpy as np
from pyibt.sweep import Sweep

COUNT, RATE = 10_000, 10_000
voltage = np.maximum(np.arange(COUNT) - COUNT // 2, 0) * 0.1  # mV: flat, then 1 mV a ms
header = struct.pack("<HHfi", 12, 1, COUNT, 32_000) + struct.pack("<fffff", 1.0, RATE / 1000, 1.0, 0.0, 1.0)
header += struct.pack("<iddd", 0, 0, 0, 0) * 5 + struct.pack("<ddf", 0, 0, 22.0) + bytes(8)
at = 16
with open("cell.ibt", "wb") as file:
    file.write(struct.pack("<h", 11).ljust(at, b"\0") + header + struct.pack("<i", at + len(header) + 4))
    file.write(struct.pack("<H", 13) + np.round(voltage / 1000 * 32_000).astype("<i2").tobytes())

sweep = Sweep("cell.ibt", at)
part, time, slope = sweep.get_data(0.6, 0.1), sweep.get_time(0.6, 0.1), sweep.get_dVdt(0.6, 0.1)
print(f"100 ms from 0.6 s: {part.size} values from {part[0]:.0f} to {part[-1]:.0f} mV, times from {time[0]} s")
print(f"slopes: {slope.size}; the first 1000 have a mean of {slope[:1000].mean():.2f} V/s, expected 1.00")
print("pyibt", meta.version("pyibt"))
still = part.size == 1000 and abs(part[-1] - part[0] - 100) < 1 and slope.size == COUNT and abs(slope[:1000].mean()) < 0.01
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
