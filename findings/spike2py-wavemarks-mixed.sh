#!/usr/bin/env bash
# spike2py mixes the wavemarks of a channel: fifty action potentials of 32 points are 32 of fifty points, each of many.
#
# Expected: documentation of Wavemark: action_potentials is a "list of lists - each list is a Wavemark". Fifty sorted spikes
#   of 32 points are fifty lists of 32.
# Seen: the values are folded into as many rows as a wavemark has points, and rows are what is looped over and drawn: 32
#   rows of fifty. If the file has a row for each spike, a row is one spike and parts of the next ones; if it has a column
#   for each, a row is one point of time of all. Nothing is raised, whatever the numbers.
# Hurts: shapes, peak-to-peak amplitudes and averages of motor units.
# (The file is written by the script with the fields of Spike2's export, in both layouts.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check spike2py==0.2.10 numpy==1.26.4 scipy==1.14.1 matplotlib==3.10.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
from pathlib import Path

import numpy as np
from scipy.io import savemat
from spike2py.read import read

SPIKES, POINTS = 50, 32
shape = np.sin(2 * np.pi * np.arange(POINTS) / POINTS)
spikes = (1 + 0.01 * np.arange(SPIKES))[:, None] * shape  # each 2.0 to 2.98 mV from peak to peak
seen = {}
for layout, values in (("a row for each spike", spikes), ("a column for each", spikes.T)):
    fields = ("title", "comment", "resolution", "interval", "scale", "offset", "units", "length", "items", "codes", "traces", "trigger")
    channel = {name: 0.0 for name in fields}
    channel |= {"units": "mV", "length": float(POINTS), "interval": 0.0005, "times": 0.1 * np.arange(SPIKES), "values": values}
    savemat("units.mat", {"Unit1": channel})
    read_spikes = read(Path("units.mat"))["Unit1"]["action_potentials"]
    sizes = [float(np.ptp(spike)) for spike in read_spikes]
    seen[layout] = (len(read_spikes), len(read_spikes[0]), round(min(sizes), 2), round(max(sizes), 2))
    print(f"{layout}: {seen[layout][0]} spikes of {seen[layout][1]} points, {seen[layout][2]} to {seen[layout][3]} mV")
print(f"written: {SPIKES} spikes of {POINTS} points, 2.0 to 2.98 mV")
print("spike2py", meta.version("spike2py"))
still = all(found[:2] == (POINTS, SPIKES) for found in seen.values()) and seen["a column for each"][3] < 0.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
