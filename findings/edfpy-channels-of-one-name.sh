#!/usr/bin/env bash
# edfpy cuts each channel's name to its second word: of "FDI right" and "APB right" one is lost, the other has both names' place.
#
# Expected: an EDF label is free text of 16 characters (EDF+ proposes a type, a space and a specification); two channels with two
#   labels are two channels. get_physical_samples without labels gives all of them.
# Seen: only the second word is kept, in capitals. "FDI right", "APB right" and "ADM left" are RIGHT, RIGHT and LEFT: two channels
#   are returned for three, RIGHT is the APB's signal, and the FDI's cannot be had by any name. Nothing is said.
# Hurts: recordings of several muscles, or of one on both sides: MEPs are taken from another muscle.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check edfpy==0.2.2 numpy==2.4.6 cached-property==2.0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from edfpy import Reader

SAMPLES, RECORDS = 10, 2


def write(path, channels):
    """An EDF file with one level for each channel, in uV."""
    count = len(channels)
    head = ["0".ljust(8), "X X X X".ljust(80), "Startdate X X X X".ljust(80), "01.01.26", "10.00.00"]
    head += [str(256 * (count + 1)).ljust(8), " " * 44, str(RECORDS).ljust(8), "1".ljust(8), str(count).ljust(4)]
    for values, width in (
        (list(channels), 16),
        ([""] * count, 80),
        (["uV"] * count, 8),
        *((([limit] * count), 8) for limit in ("-1000", "1000", "-1000", "1000")),
        ([""] * count, 80),
        ([str(SAMPLES)] * count, 8),
        ([""] * count, 32),
    ):
        head += [value.ljust(width) for value in values]
    with open(path, "wb") as file:
        file.write("".join(head).encode())
        for _ in range(RECORDS):
            for level in channels.values():
                file.write(np.full(SAMPLES, level, "<i2").tobytes())


seen = []
for channels in ({"FDI right": 100, "APB right": 200, "ADM left": 300}, {"EMG FDI": 100, "EMG APB": 200}):
    write("muscles.edf", channels)
    reader = Reader.open("muscles.edf")
    seen.append({str(name): float(signal[0]) for name, signal in reader.get_physical_samples().items()})
    print(f"written {channels}, read {seen[-1]}")
print("edfpy", meta.version("edfpy"))
still = seen == [{"RIGHT": 200.0, "LEFT": 300.0}, {"FDI": 100.0, "APB": 200.0}]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
