#!/usr/bin/env bash
# AFE's filters divide the frequency by half the rate and then take the result for hertz: all data are smoothed below 1 Hz.
#
# Expected: lpf, hpf and bpf filter at a cutoff in hertz (bpf by default from 0.2 to 20 Hz); a new AFE smooths with a cutoff of half
#   the rate, so hardly. Features look for frequencies from 0.2 to 5 Hz.
# Seen: the cutoff is made relative to half the rate, and the rate is given to the filter as well: 25 Hz of 50 Hz become 1 Hz. A
#   movement of 2 Hz is left with 12 % of its amplitude, one of 3 Hz with 4 %; a low pass at 10 Hz is one at 0.4 Hz.
# Hurts: tremor, gait and finger movements vanish; their frequency is that of a slow drift.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    AFE==2020.3.29 actigraph==2018.10.1 numpy==1.26.4 scipy==1.13.1 pandas==1.5.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from afe import AFE
from afe.features import lpf

RATE = 50
times = pd.date_range("2026-01-01", periods=60 * RATE, freq="20ms")


def movement(frequency):
    return pd.DataFrame({"x": np.sin(2 * np.pi * frequency * np.arange(times.size) / RATE)}, index=times)


def amplitude(frame):
    return round(float(frame.x[20 * RATE :].std() * np.sqrt(2)), 2)


seen = {}
for frequency in (0.5, 1.0, 2.0, 3.0):
    one = movement(frequency)
    seen[frequency] = amplitude(AFE(one).data), amplitude(AFE(one, smooth=False).data), amplitude(lpf(one, 10))
    print(f"{frequency} Hz, amplitude 1: smoothed {seen[frequency][0]}, not smoothed {seen[frequency][1]}, low pass at 10 Hz {seen[frequency][2]}")
print("AFE", meta.version("AFE"))
still = seen == {0.5: (0.99, 1.0, 0.46), 1.0: (0.71, 1.0, 0.06), 2.0: (0.12, 1.0, 0.01), 3.0: (0.04, 1.0, 0.0)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
