#!/usr/bin/env bash
# edfrd copies a file without the duration of its records, if that is a fraction of a second, and without the mark of EDF+.
#
# Expected: its documentation copies a file: read_header, read_data_records, write_header, write_data_records; it "does not
#   interpret the EDF data whenever possible". EDF: the duration of a data record is a number of seconds, such as 0.5; EDF+
#   marks its files in the reserved field.
# Seen: the duration is read as a whole number: 0.5 is None, with a warning, and blanks are written. The reserved field is not read,
#   so that EDF+C becomes EDF: the channel with the annotations is then a signal. The copy has no sampling rate.
# Hurts: files with short records, as real-time writers make them: other readers refuse the copy, or take another rate.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps edfrd==0.7
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from edfrd import read_data_records, read_header, write_data_records, write_header

FIELDS = {"reserved": slice(192, 236), "records": slice(236, 244), "duration": slice(244, 252)}


def write(path, duration):
    """An EDF+C file with one channel of EMG and one of annotations."""
    annotations = [f"+{record * float(duration):g}\x14\x14\0".ljust(20, "\0").encode() for record in range(2)]
    head = ["0".ljust(8), "X X X X".ljust(80), "Startdate X X X X".ljust(80), "01.01.26", "10.00.00", "768".ljust(8)]
    head += ["EDF+C".ljust(44), "2".ljust(8), duration.ljust(8), "2".ljust(4)]
    for values, width in (
        (("FDI", "EDF Annotations"), 16),
        (("", ""), 80),
        (("uV", ""), 8),
        (("-1000", "-1"), 8),
        (("1000", "1"), 8),
        (("-32768", "-32768"), 8),
        (("32767", "32767"), 8),
        (("", ""), 80),
        (("100", "10"), 8),
        (("", ""), 32),
    ):
        head += [value.ljust(width) for value in values]
    with open(path, "wb") as file:
        file.write("".join(head).encode())
        for annotation in annotations:
            file.write(np.arange(100, dtype="<i2").tobytes() + annotation)


def fields(path):
    with open(path, "rb") as file:
        head = file.read(256).decode()
    return {name: head[place].strip() for name, place in FIELDS.items()}


seen = {}
for duration in ("1", "0.5"):
    write("a.edf", duration)
    header = read_header("a.edf")
    records = list(read_data_records("a.edf", header))
    write_header("b.edf", header)
    write_data_records("b.edf", records)
    seen[duration] = fields("b.edf")
    print(f"original {fields('a.edf')}, copy {seen[duration]}")
print("edfrd", meta.version("edfrd"))
still = seen == {
    "1": {"reserved": "", "records": "2", "duration": "1"},
    "0.5": {"reserved": "", "records": "2", "duration": ""},
}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
