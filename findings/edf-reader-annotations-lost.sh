#!/usr/bin/env bash
# edf-reader loses every annotation of an EDF+D file; one whose text is a number has it as its duration.
#
# Expected: specification of EDF+: an annotation is its onset, an optional duration after byte 21, and texts between bytes
#   20. The attribute `annotations` has "onset", "duration" and "annotation" of each.
# Seen: bytes 20 and 21 are taken the wrong way round: what follows the first byte 20 is read as a duration. "Stim" is no
#   number, so that the entry is skipped without a word, as is every one with a duration; the trigger code "5" is an event
#   of 5 s without a text.
# Hurts: discontinuous recordings, for which the reader was made, have no stimuli, or codes as durations.
# (The file is written by the script: two records, 10 s apart.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check edf-reader==0.1.3 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from edf_reader import EdfWrapper

RATE, ROOM = 100, 120
channels = [("EMG", "mV", -5, 5, RATE), ("EDF Annotations", "", -1, 1, ROOM // 2)]
head = f"{'0':<8}{'X X X X':<80}{'Startdate 01-JAN-2026 X X X':<80}01.01.2610.00.00{256 * 3:<8}{'EDF+D':<44}{2:<8}{1:<8}{2:<4}"
head += "".join(f"{name:<16}" for name, *_ in channels) + " " * 160
head += "".join(f"{unit:<8}" for _, unit, *_ in channels)
for column in (2, 3):
    head += "".join(f"{channel[column]:<8}" for channel in channels)
head += f"{-32768:<8}" * 2 + f"{32767:<8}" * 2 + " " * 160 + "".join(f"{channel[4]:<8}" for channel in channels) + " " * 64
records = (b"+0\x14\x14\x00+0.25\x14Stim\x14\x00+0.5\x150.1\x14Train\x14\x00", b"+10\x14\x14\x00+10.25\x145\x14\x00+10.5\x14Stim\x14\x00")
with open("session.edf", "wb") as file:
    file.write(head.encode("ascii"))
    for notes in records:
        file.write(np.zeros(RATE, "<i2").tobytes() + notes.ljust(ROOM, b"\x00"))
reader = EdfWrapper("session.edf")
seen = [(entry["onset"], entry["duration"], entry["annotation"]) for entry in reader.annotations]
print("written: (0.25, Stim), (0.5, lasting 0.1 s, Train), (10.25, 5), (10.5, Stim)")
print("read:", seen, "- starts of the records:", [marker["onset"] for marker in reader.segment_markers])
print("edf-reader", meta.version("edf-reader"))
still = seen == [(10.25, 5.0, "")] and len(reader.segment_markers) == 2
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
