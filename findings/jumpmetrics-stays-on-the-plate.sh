#!/usr/bin/env bash
# jumpmetrics cannot process a jump after which the person stays on the force plate: it raises IndexError.
#
# Expected: its documentation: process_jump_trial crops, finds the events and computes the metrics of take-off and landing; the code
#   has a branch for a trace that does not leave the plate again. To stay on the plate after landing is the usual instruction.
# Seen: "does not leave again" is -100, to which the landing frame is added; the sum is taken for the frame of leaving. At 1000 and
#   2000 Hz the landing is empty and IndexError is raised; who steps down at the end is processed.
# Hurts: whole batches of jumps recorded as usual. The fix that suggests itself, a cut of the recording so that it ends with
#   an empty plate, changes the trials.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 scikit-learn==1.9.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps jumpmetrics==0.2.0
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - 2>/dev/null <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from jumpmetrics.core.jump_processing import process_jump_trial

MASS_KG, G, SPEED = 70, 9.81, 2.5  # SPEED: at take-off [m/s]


def phase(seconds, impulse, rate):
    """Body weight and half a sine of this net impulse [Ns]."""
    time = np.arange(int(seconds * rate)) / rate
    return MASS_KG * G + impulse * np.pi / 2 / seconds * np.sin(np.pi * time / seconds)


def jump(rate, steps_down):
    """The vertical force of a countermovement jump [N]."""
    parts = [
        phase(1.5, 0, rate),
        phase(0.35, -78, rate),
        phase(0.4, 78 + MASS_KG * SPEED, rate),
        np.zeros(int(2 * SPEED / G * rate)),
        phase(0.3, MASS_KG * SPEED, rate),
        phase(2, 0, rate),
        np.zeros(rate if steps_down else 0),
    ]
    force = np.concatenate(parts)
    return force + np.random.default_rng(1).normal(0, 1, force.size)


seen = {}
for rate in (1000, 2000):
    for steps_down in (True, False):
        try:
            result = process_jump_trial(
                jump(rate, steps_down), rate, "countermovement", 0.5, "P01", compute_jump_height_from_flight_time=True
            )
            seen[rate, steps_down] = f"height {result['results_dataframe']['jump_height_flight_time'].iloc[0]:.2f} m"
        except IndexError as error:
            seen[rate, steps_down] = type(error).__name__
        print(f"{rate} Hz, {'steps down' if steps_down else 'stays on the plate'}: {seen[rate, steps_down]}")
print("jumpmetrics", meta.version("jumpmetrics"))
still = all("height" in seen[rate, True] and seen[rate, False] == "IndexError" for rate in (1000, 2000))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
