#!/usr/bin/env bash
# eeglib filters bands by the number of the spectrum's line: in windows of two seconds alpha is 16 to 24 Hz.
#
# Expected: docstring of getSignalAtBands: the signal "only in the specified frequency bands"; the bands are those of the keys,
#   delta 1 to 4, theta 4 to 7, alpha 8 to 12, beta 12 to 30 Hz by default.
# Seen: the limits are turned into indices of the window's spectrum and given to the filter as hertz. Only with windows of one
#   second are both the same. Of two seconds, all bands are twice as high: 10 Hz is theta and 20 Hz alpha; of half a second half
#   as high; of four seconds at 128 Hz ValueError is raised, since 12 to 30 Hz are 48 to 120.
# Hurts: all that is made of these signals, and comparisons of windows of different lengths: a longer window has less "theta"
#   and more "alpha" of the same person.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==2.3.3 scikit-learn==1.9.1 numba==0.68.1 pyedflib==0.1.42 fastdtw==0.3.4 progressbar2==4.6.0 eeglib==0.4.1.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from eeglib.eeg import EEG

RATE = 128
still = True
for seconds, expected in (
    (1, {5: "theta", 10: "alpha", 20: "beta"}),
    (2, {5: "delta", 10: "theta", 20: "alpha", 40: "beta"}),
    (0.5, {5: "alpha", 10: "beta"}),
    (4, {10: "ValueError"}),
):
    size = int(seconds * RATE)
    for hertz, band in expected.items():
        window = EEG(size, RATE, 1)
        window.set([np.sin(2 * np.pi * hertz * np.arange(size) / RATE)], columnMode=True)
        try:
            found = {name: float(np.std(signal)) for name, signal in window.getSignalAtBands(0).items()}
            most = max(found, key=found.get)
            print(f"window of {seconds} s, {hertz} Hz: mostly in {most}; {({name: round(value, 2) for name, value in found.items()})}")
        except ValueError as error:
            most = "ValueError"
            print(f"window of {seconds} s: ValueError: {error}")
        still &= most == band
print("eeglib", meta.version("eeglib"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
