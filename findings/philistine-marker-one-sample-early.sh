#!/usr/bin/env bash
# philistine writes BrainVision markers one sample early, and in a cropped recording late by all that was cut off.
#
# Expected: docstring of write_raw_brainvision: writes Raw to BrainVision format, its events to the marker file. The format's specification
#   counts data points from 1, so that a pulse in sample 1000 (from 0) is at 1001; its position is that in the data file.
# Seen: MNE's sample numbers are written as they are. They count from 0, so that each marker is read one sample early, and from the start of
#   the recording before it was cropped: after crop(tmin=0.5) each is half a second late, at 1 kHz 499 samples.
# Hurts: MEPs and evoked potentials of exported files: 1 ms at 1 kHz, or no response at all in any epoch of a cropped recording.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mne==1.10.1 numpy==1.26.4 scipy==1.13.1 matplotlib==3.10.8 pandas==2.2.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps philistine==0.2.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import mne
import numpy as np
from philistine.mne import write_raw_brainvision

mne.set_log_level("ERROR")
RATE, PULSES = 1000, [1000, 2500, 4000]
data = np.zeros((2, 5 * RATE))
data[0, PULSES], data[1, PULSES] = 50e-6, 5
raw = mne.io.RawArray(data, mne.create_info(["Cz", "STI"], RATE, ["eeg", "stim"]))
late = {}
for name, recording in (("whole", raw), ("cropped", raw.copy().crop(tmin=0.5))):
    write_raw_brainvision(recording, f"{name}.vhdr")
    again = mne.io.read_raw_brainvision(f"{name}.vhdr", preload=True)
    pulses = np.flatnonzero(again.get_data()[0] > 25e-6)
    markers = mne.events_from_annotations(again)[0][:, 0]
    late[name] = (markers - pulses).tolist()
    print(f"{name}: pulses in the data {pulses.tolist()}, markers {markers.tolist()}, markers late by {late[name]} samples")
print("philistine", meta.version("philistine"), "MNE", mne.__version__)
still = late == {"whole": [-1] * 3, "cropped": [499] * 3}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
