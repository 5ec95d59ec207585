#!/usr/bin/env bash
# MNE exports a cropped recording with the start of the whole one.
#
# Expected: EDF and BDF specifications: the header's start is that of the recording in the file, its first sample.
#   BrainVision Core Data Format 1.0: the date of the first "New Segment" marker is that of its data point. MNE itself
#   moves the annotations of a cropped recording to the new first sample when it exports, and its own format keeps both
#   the date and how much was cut off.
# Seen: after crop(12) export_raw writes the start of the uncropped recording to EDF, BDF and BrainVision files.
#   Annotations lie right in the file, so that nothing looks wrong, but each has a time of day that is 12 s early; the
#   FIF file of the same recording has the right one.
# Hurts: cut-off preparation or a file for each block: beside the log of the stimulator, of the neuronavigation or
#   another recording, pulses are matched by time of day, and are matched wrongly by minutes.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mne==1.13.2 edfio==0.4.18 pybv==0.8.1 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import datetime as dt
import importlib.metadata as meta
import sys

import mne
import numpy as np

mne.set_log_level("ERROR")
BEGAN = dt.datetime(2026, 1, 1, 10, 0, 0, tzinfo=dt.timezone.utc)
PULSE = BEGAN + dt.timedelta(seconds=15)
emg = np.zeros((1, 40_000))
emg[0, 30_000] = 1e-3  # the artefact of the pulse, at 15 s
raw = mne.io.RawArray(emg, mne.create_info(["FDI"], 2000, "emg")).set_meas_date(BEGAN)
raw.set_annotations(mne.Annotations([15], [0], ["tms"], orig_time=BEGAN))
cropped = raw.copy().crop(12)
read = {"edf": mne.io.read_raw_edf, "bdf": mne.io.read_raw_bdf, "vhdr": mne.io.read_raw_brainvision}
early = {}
for ending, reader in (*read.items(), ("fif", mne.io.read_raw_fif)):
    path = f"block_raw.{ending}"
    if ending == "fif":
        cropped.save(path)
    else:
        mne.export.export_raw(path, cropped)
    back = reader(path, preload=True)
    at_s = float(np.argmax(back.get_data()[0]) / back.info["sfreq"])
    mark_s = float(back.annotations.onset[0] - back.first_time)
    day = back.info["meas_date"] + dt.timedelta(seconds=back.first_time + at_s)
    early[ending] = (PULSE - day).total_seconds()
    print(f"{ending}: pulse at {at_s} s of the file, marked at {mark_s:.4f} s; time of day {day:%H:%M:%S}, given {PULSE:%H:%M:%S}")
print("mne", meta.version("mne"), "edfio", meta.version("edfio"), "pybv", meta.version("pybv"))
still = early == {"edf": 12.0, "bdf": 12.0, "vhdr": 12.0, "fif": 0.0}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
