#!/usr/bin/env bash
# biomdp corrects the cut-off of its two-pass high-pass in the direction of a low-pass: 20 Hz are 31 Hz.
#
# Expected: docstring of filter_butter: fc is the cut-off frequency. Its code names the correction factor for two passes of Winter
#   (2009), which keeps the amplitude at the cut-off at 0.71: for a low-pass it raises the frequency of the filter, for a
#   high-pass it lowers it.
# Seen: it is raised for both. The low-pass at 20 Hz leaves 0.71 at 20 Hz; the high-pass leaves 0.29, and 0.71 at 31 Hz. Without any
#   correction it would leave 0.50.
# Hurts: a high-pass against drift or movement artefacts takes much more of slow EMG or force than stated.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==2.3.3 xarray==2025.6.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps biomdp==0.11.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from biomdp.filter_butter import filter_butter

RATE, CUTOFF = 1000, 20
time = np.arange(20 * RATE) / RATE
middle = slice(5 * RATE, 15 * RATE)


def left(frequency, kind):
    wave = np.sin(2 * np.pi * frequency * time)
    return float(np.std(filter_butter(wave, fr=RATE, fc=CUTOFF, order=2, kind=kind)[middle]) / np.std(wave[middle]))


seen = {kind: round(left(CUTOFF, kind), 2) for kind in ("low", "high")}
real = next(frequency for frequency in np.arange(20, 60, 0.1) if left(frequency, "high") >= np.sqrt(0.5))
print(f"amplitude left at the cut-off of {CUTOFF} Hz: {seen}; 0.71 of the high-pass is at {real:.1f} Hz")
print("biomdp", meta.version("biomdp"))
still = seen == {"low": 0.71, "high": 0.29} and 30 < real < 32
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
