#!/usr/bin/env bash
# Every second "onset" of biosppy's EMG detectors is the end of a contraction.
#
# Expected: docstrings of emg.find_onsets, hodges_bui_onset_detector and the other detectors: onsets are the "indices of EMG
#   pulse onsets", that is where a contraction begins. Three contractions, three onsets.
# Seen: the samples at which the EMG rises above the threshold and those at which it falls below are put together, sorted,
#   under one name. Three contractions of half a second have six "onsets"; nothing tells which is which.
# Hurts: counts of contractions are doubled, reaction times and intervals have the contraction's length among them, epochs
#   about onsets are half of them about rest.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    biosppy==2.2.4 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2 scikit-learn==1.9.1 h5py==3.16.0 bidict==0.24.1 \
    joblib==1.6.0 mock==5.2.0 opencv-python-headless==5.0.0.93 pywavelets==1.9.0 shortuuid==1.0.13 six==1.17.0 peakutils==1.3.5
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from biosppy.signals import emg

RATE = 1000
rng = np.random.default_rng(1)
begins, lasting = (2000, 5000, 8000), 500
signal = rng.normal(0, 0.02, 10 * RATE)
for begin in begins:
    signal[begin : begin + lasting] += 0.5 * np.sign(rng.normal(size=lasting))
rest = signal[:1500]
told = {
    "find_onsets": emg.find_onsets(signal=signal, sampling_rate=RATE)["onsets"],
    "hodges_bui": emg.hodges_bui_onset_detector(signal, rest, RATE, size=50, threshold=5)["onsets"],
    "bonato": emg.bonato_onset_detector(signal, rest, RATE, 30, 10, 2, 3)["onsets"],
}
edges = np.sort([*begins, *(begin + lasting for begin in begins)])
still = True
print("contractions begin at", begins, "and last 500 ms")
for name, onsets in told.items():
    print(f"{name}: {len(onsets)} onsets, at {np.asarray(onsets).tolist()}")
    still = still and len(onsets) == 6 and np.abs(np.asarray(onsets) - edges).max() < 60
print("biosppy", meta.version("biosppy"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
