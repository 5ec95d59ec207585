#!/usr/bin/env bash
# neurokit2's read_xdf turns markers into a ramp from one code to the next, or into a constant.
#
# Expected: XDF specification and documentation of LSL: a stream with a nominal rate of 0 is irregular; its samples are
#   events, and nothing is stated between them. Read into a table of equal steps, a code stands at its own time.
# Seen: marker streams are interpolated like signals. Numeric codes (int32) of three or more kinds go in a straight line
#   from one to the next: between the codes 1 and 3 the table says 2, a condition of its own. Other strings are held
#   until the next marker, so that ten pulses with one label are a column of zeros.
# Hurts: LabRecorder files with EMG and a marker for each pulse. Conditions appear that were never given, onsets cannot
#   be found by events_find, and of equal markers none is left. Of numeric codes no warning speaks (the docstring's one
#   is about rates and gaps).
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    neurokit2==0.3.0 pyxdf==1.17.5 numpy==2.4.6 pandas==3.0.0 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import struct
import sys

import neurokit2 as nk
import numpy as np
import pyxdf

TIMES = 100 + np.arange(1, 11.0)  # a pulse each second
CODES = [1, 3, 2, 3, 1, 1, 3, 2, 1, 3]


def chunk(tag, content):
    return struct.pack("<BIH", 4, len(content) + 2, tag) + content


def stream(number, name, rate, form, samples):
    head = (
        f"<?xml version='1.0'?><info><name>{name}</name><type>x</type><channel_count>1</channel_count>"
        f"<nominal_srate>{rate}</nominal_srate><channel_format>{form}</channel_format></info>"
    )
    body = b"".join(struct.pack("<Bd", 8, time) + value for time, value in samples)
    count = struct.pack("<IBI", number, 4, len(samples))
    return chunk(2, struct.pack("<I", number) + head.encode()) + chunk(3, count + body)


emg = [(100 + i / 1000, struct.pack("<f", np.sin(i))) for i in range(12_000)]
codes = [(time, struct.pack("<i", code)) for time, code in zip(TIMES, CODES)]
labels = [(time, struct.pack("<BB3s", 1, 3, b"tms")) for time in TIMES]
with open("session.xdf", "wb") as file:
    file.write(b"XDF:" + chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>"))
    file.write(stream(1, "emg", 1000, "float32", emg))
    file.write(stream(2, "codes", 0, "int32", codes) + stream(3, "labels", 0, "string", labels))

streams, _ = pyxdf.load_xdf("session.xdf")
raw = {one["info"]["name"][0]: one for one in streams}
print("pyxdf reads the codes", np.ravel(raw["codes"]["time_series"]).tolist(), "at", raw["codes"]["time_stamps"] - 100)
table, info = nk.read_xdf("session.xdf", verbose=False)
table.columns = ["emg", "codes", "labels"]
at = {second: float(table["codes"].iloc[np.argmin(np.abs(table.index - second))]) for second in (1, 1.25, 1.5, 2)}
print("codes in the table at seconds:", at, "distinct values:", table["codes"].nunique())
print("labels in the table:", table["labels"].dropna().unique().tolist())
found = nk.events_find(table["codes"].fillna(0).to_numpy())
print(f"events_find finds {len(found['onset'])} of 10 pulses")
print("neurokit2", meta.version("neurokit2"), "pyxdf", meta.version("pyxdf"))
still = np.allclose([at[1], at[1.25], at[1.5], at[2]], [1, 1.5, 2, 3], atol=0.01) and table["codes"].nunique() > 1000
still = still and table["labels"].dropna().nunique() == 1 and len(found["onset"]) < 10
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
