#!/usr/bin/env bash
# opensignalsreader converts a second EMG channel with the number of bits of the first: 1 mV in six bits is read as -1.5 mV.
#
# Expected: header of an OpenSignals text file: "resolution" states the bits of each column; a BITalino has ten on inputs A1
#   to A4 and six on A5 and A6. Docstring of the transfer function for EMG: n is the number of bits of the channel.
# Seen: two channels of one kind are named EMG and EMG1, their bits are stored as 10 and 6, but the conversion looks
#   them up under the name without its digit. The second muscle, 0 to 63 in six bits, is taken for ten: a sine of 1 mV is
#   read as -1.60 to -1.47 mV. Nothing is raised or warned, since all is within the sensor's range.
# Hurts: two muscles (agonist and antagonist) of which the second is on A5 or A6: an offset as large as the range and a
#   sixteenth of the amplitude.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    opensignalsreader==0.2.2 numpy==2.4.6 matplotlib==3.11.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import json
import sys

import numpy as np
from opensignalsreader import OpenSignalsReader

RATE = 1000
emg_mv = np.sin(2 * np.pi * 5 * np.arange(2 * RATE) / RATE)
header = {
    "sensor": ["EMGBITREV", "EMGBITREV"],
    "device name": "00:00:00:00:00:00",
    "column": ["nSeq", "I1", "I2", "O1", "O2", "A1", "A5"],
    "time": "10:00:00.0",
    "date": "2026-01-01",
    "comments": "",
    "device connection": "00:00:00:00:00:00",
    "channels": [1, 5],
    "firmware version": 52,
    "device": "bitalino_rev",
    "sampling rate": RATE,
    "label": ["A1", "A5"],
    "resolution": [4, 1, 1, 1, 1, 10, 6],
}


def stored(bits):
    return np.round((emg_mv / 1000 * 1009 / 3.3 + 0.5) * 2**bits).astype(int)


rows = np.column_stack([np.arange(emg_mv.size) % 16, np.zeros((emg_mv.size, 4), int), stored(10), stored(6)])
with open("muscles.txt", "w") as file:
    file.write("# OpenSignals Text File Format\n# " + json.dumps({"00:00:00:00:00:00": header}) + "\n# EndOfHeader\n")
    np.savetxt(file, rows, fmt="%d", delimiter="\t")
reader = OpenSignalsReader("muscles.txt")
seen = []
for name, signal in reader.signal().items():
    bits = reader.sampling_resolution[name]
    seen.append((bits, round(float(signal.min()), 2), round(float(signal.max()), 2)))
    print(f"{name}, stored in {bits} bits, a sine from -1 to 1 mV: read as {seen[-1][1]} to {seen[-1][2]} mV")
print("opensignalsreader", meta.version("opensignalsreader"))
still = seen == [(10, -1.0, 1.0), (6, -1.6, -1.47)]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
