#!/usr/bin/env bash
# abra exchanges the gaze's x and y in epochs, though not in trials; blinks at the start stay.
#
# Expected: its documentation: create_session splits a recording by trials, create_epochs around events; both return objects with
#   movement_X and movement_y. remove_eye_blinks replaces each blink and 50 samples around it.
# Seen: in epochs movement_X is the vertical and movement_y the horizontal position; in trials of the same recording they are right.
#   Around a blink that begins within the first 50 samples nothing is replaced.
# Hurts: saccades to the left or right seem to go up or down, which is plausible enough not to be noticed.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps abra==1.4.2
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import pathlib
import sys

import numpy as np
from abra import data

lines = ["** CONVERTED", "MSG\t900 !MODE RECORD CR 1000 2 1 R", "START\t1000\tRIGHT\tSAMPLES\tEVENTS", "SAMPLES\tGAZE\tRIGHT\tRATE\t1000.00\tTRACKING\tCR"]
# x rises from 400 to 1400 pixels, y stays at 300; a blink of 10 samples begins 20 ms after the start.
for sample in range(1000):
    missing = 20 <= sample < 30
    lines.append(f"{1000 + sample}\t.\t.\t0.0\t..." if missing else f"{1000 + sample}\t{400 + sample:.1f}\t300.0\t900.0\t...")
lines.append("END\t2000\tSAMPLES\tEVENTS\tRES\t30.00\t30.00")
pathlib.Path("P01.asc").write_text("\n".join(lines) + "\n")
recording = data.read("P01.asc")
trial = recording.create_session().data[0]
epoch = recording.create_epochs([1500], pre_event=100, post_event=100).data[0]
seen = {}
for what, part in (("trial", trial), ("epoch", epoch)):
    seen[what] = [float(np.nanmean(part.movement_X)), float(np.nanmean(part.movement_y))]
    print(f"{what}: mean of movement_X {seen[what][0]:.0f}, of movement_y {seen[what][1]:.0f} pixels")
data.remove_eye_blinks(recording, buffer=50, inplace=True)
around = int(np.isnan(recording.movement[0]).sum())
print(f"blink of 10 samples with a buffer of 50: {around} samples of the gaze left out")
print("abra", meta.version("abra"))
still = seen["trial"][0] > 800 and seen["trial"][1] == 300 and seen["epoch"][0] == 300 and seen["epoch"][1] > 800 and around == 10
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
