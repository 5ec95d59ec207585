#!/usr/bin/env bash
# ishne-to-csv reads the start's hour, minute and second of two bytes each as one byte each: 14:35:20 is 14:00:35.
#
# Expected: README, in its table of the header: the start time is hour, minute and second as three short integers, 6 bytes, and the
#   amplitude resolution is a number of nV for each lead; each sample has a correct time stamp, made with the start time.
# Seen: three bytes are read and three skipped: the minute is the upper byte of the hour, always 0, and the second is the minute.
#   The resolution is skipped: the leads are counts, whatever a count is; a peak of 1 mV is 200 or 1000.
# Hurts: ECG beside TMS or a diary: each sample is up to an hour early; amplitudes of two recorders differ by their resolutions.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 pandas==3.1.1 tqdm==4.70.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps ishne-to-csv==1.2
cd "$tmp"
TZ=UTC "$tmp/venv/bin/python" -W ignore - <<'PY'
import datetime
import importlib.metadata as meta
import json
import struct
import sys

from ishne_to_csv.core import read_ishne


def recording(name, start, resolution):
    """One lead, four samples at 200 Hz with a peak of 1 mV, as the standard lays it out (Badilini, 1998)."""
    block = struct.pack("<h40s40s20shh3h3h3h3hh", 1, b"A", b"B", b"1", 1, 1, 1, 1, 1960, 30, 11, 2026, 30, 11, 2026, *start, 1)
    block += struct.pack("<12h12h12hh40sh", 1, *[-9] * 11, 0, *[-9] * 11, resolution, *[-9] * 11, 0, b"", 200)
    block += bytes(80 + 80 + 88)
    samples = struct.pack("<4h", 0, 1_000_000 // resolution, 0, 0)
    with open(name, "wb") as file:
        file.write(b"ISHNE1.0" + struct.pack("<Hiiii", 0, 0, 4, 522, 10 + 512) + block + samples)


seen = []
for resolution in (1000, 5000):  # nV
    recording("one.ecg", (14, 35, 20), resolution)
    table = read_ishne("one.ecg", verbose=False, metadata_file="one.json")
    first = datetime.datetime.fromtimestamp(int(table["time"][0]) / 1e9, datetime.timezone.utc).time().isoformat()
    seen.append((first, json.load(open("one.json"))["Start Time"], int(table["Lead_1"].max()), len(table)))
    print(f"started at 14:35:20, {resolution} nV a count: first sample {seen[-1][0]}, start {seen[-1][1]}, a peak of 1 mV is {seen[-1][2]}")
print("ishne-to-csv", meta.version("ishne-to-csv"))
still = seen == [("14:00:35", "14:00:35", 1000, 4), ("14:00:35", "14:00:35", 200, 4)]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
