#!/usr/bin/env bash
# philistine cuts the sampling interval to whole microseconds: a recording at 2048 Hz has 2049.18 Hz, and ten minutes are 0.35 s shorter.
#
# Expected: notes of write_raw_brainvision: "The actual EEG recording should be losslessly preserved within the realm of floating point
#   precision". BrainVision's specification gives SamplingInterval in microseconds with decimals allowed; MNE reads them.
# Seen: the interval is int(1e6 / rate): 488 for 488.28125 us. 2048 Hz (BioSemi, TMSi) is read as 2049.18 Hz, 300 Hz as 300.03 Hz. All times
#   and frequencies of the file are off by 0.06 %, so that a time after ten minutes is 346 ms early. 1000 Hz is right.
# Hurts: whoever puts such EEG beside another device's clock, a log of stimuli, or the file it was exported from.
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
seen = {}
for rate in (1000, 2048, 300):
    data = np.zeros((1, 600 * rate + 1))
    data[0, 600 * rate] = 50e-6  # a pulse after ten minutes
    write_raw_brainvision(mne.io.RawArray(data, mne.create_info(["Cz"], rate, "eeg")), f"{rate}.vhdr", events=False)
    again = mne.io.read_raw_brainvision(f"{rate}.vhdr", preload=True)
    early = 600 - again.times[int(again.get_data()[0].argmax())]
    seen[rate] = (round(again.info["sfreq"], 2), round(1000 * early))
    print(f"{rate} Hz: read as {seen[rate][0]} Hz, a pulse after ten minutes {seen[rate][1]} ms early")
print("philistine", meta.version("philistine"), "MNE", mne.__version__)
still = seen == {1000: (1000.0, 0), 2048: (2049.18, 346), 300: (300.03, 60)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
