#!/usr/bin/env bash
# A quarter of the EDF+ files that edfio writes with a start to the microsecond are refused by pyedflib.
#
# Expected: EDF+ specification, 2.2.4: in a continuous file the onset of each data record is that of the one before plus
#   the duration of a record. edfio states that it writes EDF+C, and pyedflib (EDFlib) that it reads it.
# Seen: edfio adds the fraction of the start to the record's number in binary floating point and writes all digits, such as
#   +1.9999989999999999 after +0.999999. EDFlib cuts an onset at 100 ns, finds that two records are not exactly one
#   duration apart and refuses the file as not compliant. Neither library is told of anything unusual: a start that
#   comes from the clock is enough. Starts to the millisecond are hit too; whole seconds and .5 are not.
# Hurts: a lab that stamps its EMG with the time of day, and whoever opens it in EDFbrowser or through pyedflib.
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


def outcome(microseconds, seconds=60):
    signal = edfio.EdfSignal(np.arange(seconds * 100) % 100, 100, label="FDI")
    edfio.Edf([signal], starttime=dt.time(3, 4, 5, microseconds)).write("emg.edf")
    try:
        with pyedflib.EdfReader("emg.edf") as reader:
            return reader.datarecords_in_file == seconds
    except OSError as error:
        return str(error).split(": ", 1)[1]


one = outcome(999999)
onsets = re.findall(rb"\+[0-9.]+\x14\x14", open("emg.edf", "rb").read())[:3]
print("onsets of records:", [onset[:-2].decode() for onset in onsets], "->", one)
draws = np.random.default_rng(1).integers(1_000_000, size=200)
refused = sum(outcome(int(draw)) is not True for draw in draws)
plain = [outcome(value) for value in (0, 500000)]
print(f"{refused} of {len(draws)} starts drawn at random refused; at 0 and .5 s: {plain}")
print("edfio", meta.version("edfio"), "pyedflib", meta.version("pyedflib"))
still = "not EDF(+)" in str(one) and refused > 20 and plain == [True, True]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
