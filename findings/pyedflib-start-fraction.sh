#!/usr/bin/env bash
# pyedflib writes the fraction of a second of the start ten times too large, drops it from 100 ms on, and reads a tenth.
#
# Expected: EDF+ specification, 2.2.4: the onset in the first timekeeping annotation of the file is the fraction of
#   a second by which the first sample follows the start in the header. EDFlib, which pyedflib wraps, documents
#   starttime_subsecond in units of 100 ns: microseconds times ten.
# Seen: the released version multiplies (and divides) by 100. A start at .001 s is stored as .01 s; at .25 s the product is out
#   of range and the fraction is 0, without a word. A file of edfio with .25 s is read as .025 s.
#   (A change of it is merged in the project, July 2026; the newest release on PyPI is older.)
# Hurts: a recording is laid beside another one (stimulator's log, video, EEG) by its start: up to 0.9 s of error.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check pyedflib==0.1.42 edfio==0.4.18 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import datetime as dt
import importlib.metadata as meta
import re
import sys

import edfio
import numpy as np
import pyedflib

header = {
    "label": "FDI", "dimension": "uV", "sample_frequency": 1000, "transducer": "", "prefilter": "",
    "physical_max": 1000, "physical_min": -1000, "digital_max": 32767, "digital_min": -32768,
}
written = {}
for microseconds in (1000, 250000):
    writer = pyedflib.EdfWriter("p.edf", 1, file_type=pyedflib.FILETYPE_EDFPLUS)
    writer.setSignalHeader(0, header)
    writer.setStartdatetime(dt.datetime(2026, 1, 2, 3, 4, 5, microseconds))
    writer.writeSamples([np.zeros(3000)])
    writer.close()
    onset = re.search(rb"\+([0-9.]+)\x14\x14", open("p.edf", "rb").read()).group(1).decode()
    written[microseconds] = float(onset)
    print(f"pyedflib asked for a start at {microseconds / 1e6} s past the second writes +{onset}; "
          f"edfio reads {edfio.read_edf('p.edf').starttime}")
edfio.Edf([edfio.EdfSignal(np.zeros(3000), 1000)], starttime=dt.time(3, 4, 5, 250000)).write("e.edf")
with pyedflib.EdfReader("e.edf") as reader:
    read, units = reader.getStartdatetime().microsecond, reader.starttime_subsecond
print(f"edfio writes .25 s; pyedflib has {units} × 100 ns and says {read / 1e6} s")
print("pyedflib", meta.version("pyedflib"), "edfio", meta.version("edfio"))
still = written == {1000: 0.01, 250000: 0.0} and read == 25000 and units == 2500000
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
