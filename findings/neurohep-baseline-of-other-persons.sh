#!/usr/bin/env bash
# NeuroHEP's baseline correction takes the median over persons as well as time: a drift of 100 uV stays as it is.
#
# Expected: preprocess_ecg_eeg takes a matrix of persons by time points, each row "a signal from a subject"; its source: "Apply median filter
#   for baseline correction", with a window of 501 samples, that is 2 s at 250 Hz.
# Seen: scipy's medfilt is given one number for a matrix with two dimensions, so that the window is 501 persons by 501 samples. Outside the
#   matrix there are zeros: with fewer than about 250 persons most of the window is zero, and so is its median. Nothing is subtracted.
# Hurts: heartbeat-evoked potentials of a few microvolts on electrode drifts of hundreds, and whoever waits: 20 s for 6 s of two persons.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mne==1.10.1 neurokit2==0.2.13 numpy==2.2.6 scipy==1.15.3 pandas==2.2.3 matplotlib==3.10.8 PyWavelets==1.7.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps neurohep==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import mne
import numpy as np
from neurohep.preprocessing import preprocess_ecg_eeg
from scipy.signal import medfilt

mne.set_log_level("ERROR")
RATE = 250
time = np.arange(3 * RATE) / RATE
eeg = np.vstack([5 * np.sin(2 * np.pi * 10 * time) + drift * time / 3 for drift in (100, -100)])
ecg = np.zeros_like(eeg)
cleaned = preprocess_ecg_eeg(ecg, eeg, RATE, notch_freq=50)[1]
notched = mne.filter.notch_filter(eeg, RATE, 50, verbose=False)
seen = []
for person in range(2):
    own = notched[person] - medfilt(notched[person], 501)
    middle = slice(RATE, 2 * RATE)
    drifts = [float(np.polyfit(time[middle], signal[middle], 1)[0]) for signal in (notched[person], cleaned[person], own)]
    seen.append(drifts)
    print(f"person {person}: drift {drifts[0]:.1f} uV/s, after the correction {drifts[1]:.1f}, with the person's own median {drifts[2]:.1f}")
print("NeuroHEP", meta.version("neurohep"))
still = np.allclose(cleaned, notched) and all(abs(own) < abs(left) / 5 for _, left, own in seen)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
