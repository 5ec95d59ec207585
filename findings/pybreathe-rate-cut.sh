#!/usr/bin/env bash
# pybreathe cuts the sampling rate to the whole number below: 15 Hz are 14, so 15 breaths a minute are 14.
#
# Expected: docstring of compute_sampling_rate: the sampling rate in Hz of a time vector in seconds. Breathing rate, times and the
#   phases between chest and abdomen are made with it.
# Seen: one second is divided by the step, rounded to the nanosecond, and the result is cut. Where the step is rounded up, the
#   rate is one too low: 6, 7, 15, 60, 150, 240, 600 and 1024 Hz are 5, 6, 14, 59, 149, 239, 599 and 1023. 25, 30, 100 or
#   1000 Hz are right.
# Hurts: breathing rate and minute ventilation are 7 % too low at 15 Hz and 17 % at 6 Hz, by nothing but the recorder's rate;
#   the inspiratory times are not, so that the cycles no longer add up.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==2.3.3 matplotlib==3.10.8 seaborn==0.13.2 pypdf==6.4.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pybreathe==0.2.2
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from pybreathe.base.breathingflow import BreathingFlow

LOW, BREATHS = (6, 15, 60, 150, 240, 600), 15
still = True
for rate in (*LOW, 25, 30, 100):
    times = np.arange(60 * rate) / rate
    table = pd.DataFrame({"time": times, "values": np.sin(2 * np.pi * BREATHS / 60 * times + 0.1)})
    flow = BreathingFlow.from_dataframe(identifier="test", df=table)
    found = flow.get_frequency(method="fft", n_digits=5)
    print(f"{rate} Hz: {flow.get_hz()} Hz, {BREATHS} breaths a minute are {found}")
    expected = rate - (rate in LOW)
    still &= flow.get_hz() == expected and abs(found - BREATHS * expected / rate) < 0.01
print("pybreathe", meta.version("pybreathe"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
