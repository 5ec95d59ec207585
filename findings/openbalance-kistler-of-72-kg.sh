#!/usr/bin/env bash
# openbalance adds 72 kg to each of the four sensors of a Kistler plate: sway is a seventh to a quarter of what it was.
#
# Expected: its documentation: reads raw data of commercial plates (Kistler among them) and computes the centre of pressure, the sum of
#   each sensor's place times its force, divided by the sum of the forces. The reader names no person's mass.
# Seen: KistlerReader divides the forces by 9.81 and adds 72 to each. A person of 50 kg weighs 338 kg; a path of 191 cm is one of
#   28 cm for 50 kg and one of 49 cm for 100 kg, and a weight distribution index of 5.4 is 0.8 and 1.4.
# Hurts: posturography: all sway too little, the light ones most of all, so that they seem to be more stable than heavy ones, and
#   values cannot be compared with those of other plates.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps openbalance==0.1.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from openbalance.io.readers.kistler import KistlerReader
from openbalance.processing.filters import apply_lowpass_filter
from openbalance.processing.kinematics import calculate_cop, calculate_path_length, calculate_wdi

RATE, CORNERS = 100, [(-20, 20), (20, 20), (-20, -20), (20, -20)]  # [Hz], [cm]
SENSORS = ["Fz3", "Fz4", "Fz1", "Fz2"]  # in the order of CORNERS, as the reader takes them
time = np.arange(30 * RATE) / RATE
x, y = 4 + 3 * np.sin(2 * np.pi * 0.5 * time), 2 * np.sin(2 * np.pi * 0.2 * time)
path = np.hypot(np.diff(x), np.diff(y)).sum()
seen = {}
for mass_kg in (50, 72, 100):
    share = [0.25 * (1 + x * corner[0] / 400 + y * corner[1] / 400) for corner in CORNERS]
    forces = dict(zip(SENSORS, (mass_kg * 9.81 * one for one in share)))
    assert np.allclose(sum(one * corner[0] for one, corner in zip(share, CORNERS)), x)
    index = np.mean(np.sqrt(np.mean((100 * np.array(share) - 25) ** 2, axis=0)))
    with open("quiet stance.txt", "w") as file:
        file.write("header\n" * 17 + "abs time (s)\tFz1\tFz2\tFz3\tFz4\ns\tN\tN\tN\tN\n")
        for row in zip(time, *(forces[name] for name in ("Fz1", "Fz2", "Fz3", "Fz4"))):
            file.write("\t".join(f"{value:.4f}" for value in row) + "\n")
    trial = calculate_cop(apply_lowpass_filter(KistlerReader().read("quiet stance.txt", RATE)), CORNERS)
    found = calculate_path_length(calculate_wdi(trial, *trial.filtered_data.T)).parameters
    total = float(trial.raw_data.sum(axis=1).mean())
    seen[mass_kg] = round(total), round(float(found["Path_Length"])), float(found["WDI"]), index
    print(
        f"{mass_kg} kg: read as {seen[mass_kg][0]} kg; path {path:.0f} cm, found {seen[mass_kg][1]} cm; "
        f"weight distribution index {index:.1f}, found {found['WDI']:.1f}"
    )
print("openbalance", meta.version("openbalance"))
still = all(seen[mass_kg][0] == mass_kg + 288 for mass_kg in seen)
still &= all(abs(seen[mass_kg][1] - path * mass_kg / (mass_kg + 288)) < 2 for mass_kg in seen)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
