#!/usr/bin/env bash
# neo reads the BrainVision files that pybv writes by default ten times too large.
#
# Expected: the header line of a channel is "Ch1=<Name>,<Reference>,<Resolution in Unit>,<Unit>"; a stored number
#   times the resolution is the value in the unit, whatever the binary format (BrainVision Core Data Format 1.0,
#   section on channel infos). pybv's defaults are IEEE_FLOAT_32 with a resolution of 0.1 µV: it stores 10,000 for 1 mV.
# Seen: neo uses the resolution for INT_16 only. For IEEE_FLOAT_32 its gain is always 1, without a warning, so the same
#   potentials come out ten times as large as from MNE and from the same file written as INT_16.
# Hurts: whoever reads EMG or EEG that was converted for BIDS with pybv (or exported by MNE) through neo,
#   SpikeInterface or Elephant: a motor evoked potential of 1 mV becomes 10 mV.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check neo==0.14.6 pybv==0.8.1 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import importlib.metadata as meta
import sys

import neo
import numpy as np
import pybv

volts = np.zeros((1, 5000))
volts[0, 1000:1010] = 1e-3  # one response of 1 mV
seen = {}
for fmt in ("binary_float32", "binary_int16"):
    resolution = 0.1  # pybv's default, in µV
    pybv.write_brainvision(
        data=volts, sfreq=5000, ch_names=["FDI"], fname_base=fmt, folder_out=".", fmt=fmt, resolution=resolution
    )
    signal = neo.io.BrainVisionIO(f"{fmt}.vhdr").read_block().segments[0].analogsignals[0]
    stored = np.fromfile(f"{fmt}.eeg", dtype="<f4" if fmt == "binary_float32" else "<i2").max()
    seen[fmt] = float(signal.rescale("mV").magnitude.max())
    print(f"{fmt}: stored {stored:g}, resolution {resolution} µV, neo says {seen[fmt]:.3f} mV (true 1 mV)")
print("neo", meta.version("neo"), "pybv", meta.version("pybv"))
still = abs(seen["binary_float32"] - 10) < 0.01 and abs(seen["binary_int16"] - 1) < 0.001
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
