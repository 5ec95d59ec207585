#!/usr/bin/env bash
# edf-buffered-write writes one last record on closing: if one channel lags, all that the others have beyond it is lost.
#
# Expected: its documentation: blocks of arbitrary size for each signal; close flushes "any pending samples, padding the final record".
# Seen: while a channel lags, the others wait in their buffers. flush writes one record and empties all buffers: with three seconds
#   of EMG pending, and a fifth of a second of the trigger channel, one second of EMG is written; two are lost without a word.
# Hurts: two devices in one file, of which one ends or drops out earlier: the other's end is gone.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check edf-buffered-write==2.5.0 pyedflib==0.1.42 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pyedflib
from edf_buffered_write import BufferedEdfWriter

RATE = 100
header = {"dimension": "uV", "sample_frequency": RATE, "physical_min": -1000.0, "physical_max": 1000.0}
header |= {"digital_min": -32768, "digital_max": 32767, "prefilter": "", "transducer": ""}
writer = pyedflib.EdfWriter("a.edf", 2)
writer.setSignalHeaders([{**header, "label": label} for label in ("EMG", "Trigger")])
writer.setDatarecordDuration(1)
buffered = BufferedEdfWriter(writer)
emg = np.arange(5 * RATE, dtype=float)  # five seconds; the trigger channel ends after 2.2
for block in range(50):
    now = slice(block * RATE // 10, (block + 1) * RATE // 10)
    buffered.write_samples([emg[now], np.zeros(RATE // 10 if block < 22 else 0)])
buffered.close()
with pyedflib.EdfReader("a.edf") as reader:
    read = reader.readSignal(0)
print(f"EMG handed over: {emg.size / RATE:g} s, up to {emg[-1]:g} uV; in the file: {read.size / RATE:g} s, up to {read.max():.0f} uV")
print("edf-buffered-write", meta.version("edf-buffered-write"), "pyedflib", meta.version("pyedflib"))
still = read.size == 3 * RATE and round(read.max()) == 3 * RATE - 1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
