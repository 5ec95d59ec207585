#!/usr/bin/env bash
# opendsp's resampling to a higher rate stretches the signal: a second of 10 Hz at 100 Hz has 9.91 Hz at 1000 Hz.
#
# Expected: docstring of resample_hz: a signal is resampled from one rate to another; a sample at 0.8 s is at 0.8 s, a rhythm keeps its
#   frequency.
# Seen: the last new sample is put on the last old one, which is one old sample earlier than the new one's time, so that everything before is
#   stretched, too: an R peak at 0.8 s is at 0.807 s. The shorter the window, the more: by 1 % in a second, by 5 % in a fifth. To lower
#   rates times are kept.
# Hurts: windows at different rates that are brought to one, as of ECG and pulse wave: delays between them change.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps opendsp==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from opendsp import resample_hz

seen = {}
for seconds in (0.2, 1, 10):
    time = np.arange(round(seconds * 100)) / 100
    at = 0.8 * seconds
    pulse = resample_hz(np.exp(-(((time - at) / 0.02) ** 2)), 100, 1000)
    seen[seconds] = len(pulse) / 1000, round(float(np.argmax(pulse)) / 1000 - at, 4)
    print(f"window of {seconds} s, peak at {at:.2f} s: {seen[seconds][0]} s long, the peak {1000 * seen[seconds][1]:.0f} ms late")
wave = resample_hz(np.sin(2 * np.pi * 10 * np.arange(100) / 100 + 0.1), 100, 1000)
crossings = np.flatnonzero((wave[:-1] < 0) & (wave[1:] >= 0))
frequency = (len(crossings) - 1) / ((crossings[-1] - crossings[0]) / 1000)
lower = resample_hz(np.exp(-(((np.arange(1000) / 1000 - 0.8) / 0.02) ** 2)), 1000, 100)
print(f"10 Hz in a second at 100 Hz are {frequency:.2f} Hz at 1000 Hz; from 1000 to 100 Hz the peak is at {np.argmax(lower) / 100} s")
print("opendsp", meta.version("opendsp"))
still = 0.006 <= seen[1][1] <= 0.009 and 0.006 <= seen[0.2][1] <= 0.009 and frequency < 9.95 and np.argmax(lower) == 80
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
