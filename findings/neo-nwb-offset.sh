#!/usr/bin/env bash
# neo applies the `conversion` of an NWB series and leaves out its `offset`.
#
# Expected: NWB core schema, TimeSeries.data: the value in the unit is stored number × conversion + offset.
#   An ADC that stores unsigned numbers around its mid-scale needs both.
# Seen: neo folds a conversion such as 1e-6 into the unit (µV) and has no offset: each sample is wrong by a constant.
#   pynwb's own get_data_in_units() applies both.
# Hurts: whoever rectifies the EMG, takes its mean before the pulse or looks for saturation: a silent muscle has an
#   activity of the size of the offset. Peak-to-peak amplitudes hide it, since a constant cancels in them.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check neo==0.14.6 pynwb==4.2.0 hdmf==6.2.0 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import datetime as dt
import importlib.metadata as meta
import sys

import neo
import numpy as np
import pynwb

nwb = pynwb.NWBFile("a session", "adc", dt.datetime(2026, 1, 1, tzinfo=dt.timezone.utc))
stored = np.array([32768, 32768, 33268, 32268, 32768], dtype=np.uint16)[:, None]  # silence, +500 µV, -500 µV
nwb.add_acquisition(
    pynwb.TimeSeries(name="emg", data=stored, unit="volts", conversion=1e-6, offset=-32768e-6, rate=1000.0)
)
with pynwb.NWBHDF5IO("adc.nwb", "w") as io:
    io.write(nwb)
with pynwb.NWBHDF5IO("adc.nwb", "r") as io:
    right = io.read().acquisition["emg"].get_data_in_units().ravel() * 1e6
signal = neo.io.NWBIO("adc.nwb", "r").read_all_blocks()[0].segments[0].analogsignals[0]
got = signal.rescale("uV").magnitude.astype(float).ravel()
print("pynwb, µV:", np.round(right, 3))
print("neo, µV:  ", got)
print("neo", meta.version("neo"), "pynwb", meta.version("pynwb"))
still = np.allclose(right, [0, 0, 500, -500, 0]) and np.allclose(got - right, 32768)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
