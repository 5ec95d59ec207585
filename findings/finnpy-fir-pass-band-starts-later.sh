#!/usr/bin/env bash
# finnpy's high-pass starts to pass where its pass band should have begun; its other filters are half a sample late.
#
# Expected: docstring of fir: f_low is the "start of the pass band", f_high its end, trans_width the width of the transition; "this
#   filter is always a zero-phase filter".
# Seen: as a high-pass f_low is where the stop band ends: with 20 Hz and a transition of 10 Hz, 20 Hz is left with 5 % and 25 Hz
#   with half; as a band-pass 20 Hz is passed. Low-passes and band-passes have an even number of coefficients, so that
#   everything is half a sample late.
# Hurts: a high-pass for drift takes the slow part of an MEP with it; filtered and unfiltered channels are apart, by 0.5 ms at 1 kHz.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps finnpy==2.0.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from finnpy.filters.frequency import fir

RATE, TRANSITION = 1000, 10
time = np.arange(10 * RATE) / RATE
middle = slice(2 * RATE, 8 * RATE)


def passed(frequency, low, high):
    """Share of the amplitude that is left, and the delay in samples."""
    wave = np.exp(-2j * np.pi * frequency * time[middle])
    signal = np.sin(2 * np.pi * frequency * time)
    ratio = np.dot(fir(signal, low, high, TRANSITION, RATE)[middle], wave) / np.dot(signal[middle], wave)
    return abs(ratio), -np.angle(ratio) / (2 * np.pi * frequency) * RATE


seen = {}
for frequency in (10, 20, 25, 30):
    seen[frequency] = [round(float(passed(frequency, 20, high)[0]), 2) for high in (None, 400)]
    print(f"{frequency} Hz: high-pass from 20 Hz leaves {seen[frequency][0]}, band-pass from 20 Hz {seen[frequency][1]}")
delays = {}
for name, limits in (("high-pass", (20, None)), ("band-stop", (200, 100)), ("low-pass", (None, 100)), ("band-pass", (20, 100))):
    delays[name] = round(float(passed(40, *limits)[1]), 2)
print("delay in samples at 40 Hz:", delays)
print("finnpy", meta.version("finnpy"))
still = (
    seen[20][0] < 0.1 < 0.9 < seen[20][1]
    and 0.4 < seen[25][0] < 0.6
    and {name: abs(delay) for name, delay in delays.items()} == {"high-pass": 0.0, "band-stop": 0.0, "low-pass": 0.5, "band-pass": 0.5}
)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
