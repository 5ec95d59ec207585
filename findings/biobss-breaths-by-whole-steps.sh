#!/usr/bin/env bash
# BioBSS takes respiration at another rate than it says: of pulses at 25 Hz, 15 breaths a minute are 12.
#
# Expected: docstring of extract_resp_sig: resampling_rate is the sampling rate of the extracted respiratory signal, 10 Hz by default;
#   estimate_rr has the same default. 15 breaths a minute are 15, whatever rate the pulses were recorded at.
# Seen: every n-th sample is taken, n being the rate divided by the new one and cut to a whole number: 25 Hz become 12.5 Hz, 64 Hz 10.7 Hz,
#   128 Hz 10.7 Hz, 256 Hz 10.2 Hz. estimate_rr counts these as 10 Hz.
# Hurts: wristbands have pulses at 25 and 64 Hz. Their breaths are 20 % and 6 % too few, those at 100 Hz right, without a word.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps biobss==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import importlib.util
import types
from pathlib import Path

root = Path(importlib.util.find_spec("biobss").origin).parent
for name in ("biobss", "biobss.common", "biobss.preprocess", "biobss.resptools"):  # without the plots and detectors that the packages import
    module = types.ModuleType(name)
    module.__path__ = [str(root.joinpath(*name.split(".")[1:]))]
    sys.modules[name] = module
for name in ("neurokit2", "heartpy"):  # neither is called by what follows
    sys.modules[name] = types.ModuleType(name)

import numpy as np
from biobss.resptools.resp_estimation import estimate_rr, extract_resp_sig

seen = {}
for rate in (25, 50, 64, 100, 128, 256):
    time = np.arange(0, 120, 1 / rate)
    pulse = (1 + 0.3 * np.sin(2 * np.pi * 0.25 * time)) * np.sin(2 * np.pi * 1.25 * time)
    peaks = np.round((np.arange(1, 148) + 0.25) / 1.25 * rate).astype(int)
    troughs = np.round((np.arange(0, 148) + 0.75) / 1.25 * rate).astype(int)
    breaths = extract_resp_sig(pulse, peaks, troughs, rate, ["AM"])
    found = estimate_rr(breaths["am_y"], delta=0.1)
    spacing = rate / np.diff(breaths["am_x"])[0]
    seen[rate] = found, spacing
    print(f"{rate} Hz: {found:.2f} breaths a minute for 15, the extracted signal has {spacing:.2f} Hz for 10")
print("biobss", meta.version("biobss"))
still = all(abs(found - 15 * 10 / spacing) < 0.15 for found, spacing in seen.values()) and abs(seen[25][0] - 12) < 0.15 and abs(seen[64][0] - 14.06) < 0.15 and abs(seen[100][0] - 15) < 0.05
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
