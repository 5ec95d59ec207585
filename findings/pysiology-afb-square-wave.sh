#!/usr/bin/env bash
# pysiology's amplitude of the first burst is not that of the burst: it is smoothed from a square wave, not from the square.
#
# Expected: docstring of getAFB and the article it names (Du and Vuskovic, 2004): the first peak of the squared EMG,
#   smoothed by a Hamming window whose width is stated in milliseconds; a burst twice as large has four times the amplitude, and
#   none is below zero.
# Seen: "squared" is scipy.signal.square, a square wave whose phase is the EMG: 1 for 0 to pi volts, -1 for negative
#   ones. The result is between -1 and 1: for bursts of 10 and 20 uV and of 1 V the same number, negative for some. The
#   window has 32000 / rate samples: 32 at 1000 Hz, but 8 (2 ms) at 4000 Hz.
# Hurts: the feature is one of those that analyzeEMG puts beside the RMS; it states nothing about the amplitude.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    pysiology==0.0.9.71 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2 peakutils==1.3.5 setuptools==75.8.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pysiology.electromyography import getAFB

rng = np.random.default_rng(1)
seen = {}
for rate in (1000, 4000):
    shape = rng.normal(0, 0.01, rate)
    shape[rate // 2 : 7 * rate // 10] += rng.normal(0, 1, rate // 5)  # a burst of 200 ms
    width = 32 * rate // 1000
    smooth = np.convolve(np.hamming(width) / np.hamming(width).sum(), shape**2, mode="valid")
    for volts in (10e-6, 20e-6, 1.0):
        seen[rate, volts] = float(getAFB(list(volts * shape), rate))
        print(f"{rate} Hz, burst of {volts:g} V: {seen[rate, volts]:.4f} (largest smoothed square {volts**2 * smooth.max():.2g})")
print("pysiology", meta.version("pysiology"))
still = all(seen[rate, 10e-6] == seen[rate, 20e-6] == seen[rate, 1.0] for rate in (1000, 4000)) and min(seen.values()) < 0
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
