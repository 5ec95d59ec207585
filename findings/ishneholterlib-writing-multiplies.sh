#!/usr/bin/env bash
# ishneholterlib turns the millivolts in memory into counts when it writes them, and cuts: a copy is a step nearer to zero.
#
# Expected: docstring of save_data: samples are converted from int16 to floats in mV; of write_file: convert_data says whether they
#   need to be converted back. The recording in memory is in mV before and after, and a file read and written is the same file.
# Seen: the array of the recording itself is multiplied: after write_file 1 mV is 400 "mV"; what is written a second time is 400
#   times too large and turns over beyond int16. The products are cut, not rounded: with a resolution of 2500 nV 42 of
#   2001 values lose one step towards zero.
# Hurts: the anonymisation that the library is for (deidentify, then write_file) and everything that is computed after it.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 crccheck==1.3.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps ishneholterlib==2020.5.29
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import struct
import sys

import numpy as np
from crccheck.crc import Crc16CcittFalse
from ishneholterlib import Holter

counts = np.arange(-1000, 1001, dtype="<i2")  # 2500 nV a step: -2.5 to 2.5 mV
head = bytearray(512)
struct.pack_into("<iiiih", head, 0, 0, len(counts), 522, 522, 1)
struct.pack_into("<9h", head, 128, 1, 1, 1980, 1, 1, 2020, 1, 1, 2020)
struct.pack_into("<3h", head, 140, 12, 0, 0)
struct.pack_into("<h12h", head, 146, 1, 5, *[-9] * 11)
struct.pack_into("<12h", head, 172, 1, *[-9] * 11)
struct.pack_into("<12h", head, 196, 2500, *[-9] * 11)
struct.pack_into("<h", head, 262, 200)
with open("one.ecg", "wb") as file:
    file.write(b"ISHNE1.0" + struct.pack("<H", Crc16CcittFalse.calc(bytes(head))) + bytes(head) + counts.tobytes())


def read(path):
    one = Holter(path)
    one.load_data(convert=False)
    return one.lead[0].data.astype(int)


one = Holter("one.ecg")
one.load_data()
one.deidentify()
before = float(one.lead[0].data.max())
for path in ("two.ecg", "three.ecg"):
    one.filename = path
    one.write_file()
    print(f"largest value in memory: {before:g} mV, after writing {path} {one.lead[0].data.max():g}")
second, third = read("two.ecg"), read("three.ecg")
lost = int((second != counts).sum())
print(f"first copy: {lost} of {len(counts)} values another, all nearer to zero: {bool((abs(second) <= abs(counts)).all())}")
print(f"second copy: {int((third != counts).sum())} of {len(counts)} values another, from {third.min()} to {third.max()}")
print("ishneholterlib", meta.version("ishneholterlib"))
still = one.lead[0].data.max() > 1000 * before and lost == 42 and int((third != counts).sum()) > 1900
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
