#!/usr/bin/env bash
# wonambi reads the first half of each record's annotations in EDF+: most or all stimuli are lost.
#
# Expected: EDF+ specification, 2.2: annotations are text in a signal named "EDF Annotations", two characters in the room of
#   each sample. Dataset.read_markers returns them.
# Seen: as many bytes are read as the signal has samples in a record, half of what is there. Annotations in the second half
#   are lost: of at most one a record none is left (files of edfio, and so of MNE), of 16 taps and 16 pulses 50 ms later six
#   and one. Nothing is raised or warned.
# Hurts: every analysis of stimuli: no trials, or a few of them, with taps and pulses that do not belong together.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    wonambi==7.17 edfio==0.4.18 mne==1.13.2 numpy==2.4.6 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
from collections import Counter

import edfio
import mne
import numpy as np
from wonambi import Dataset

mne.set_log_level("ERROR")
PULSES = np.arange(1.234, 59, 3.7)
emg = np.zeros(60_000)


def write(path, events):
    notes = [edfio.EdfAnnotation(float(onset), None, name) for onset, name in sorted(events)]
    edfio.Edf([edfio.EdfSignal(emg, 1000, label="FDI", physical_range=(-1, 1))], annotations=notes).write(path)


write("pulses.edf", [(at, "tms") for at in PULSES])
write("pairs.edf", [(at, "tms") for at in PULSES] + [(at - 0.05, "tap") for at in PULSES])
raw = mne.io.RawArray(emg[None], mne.create_info(["FDI"], 1000, "emg"))
mne.export.export_raw("mne.edf", raw.set_annotations(mne.Annotations(PULSES, 0, "tms")))
seen = {}
for path in ("pulses.edf", "mne.edf", "pairs.edf"):
    there = Counter(note.text for note in edfio.read_edf(path).annotations)
    seen[path] = dict(Counter(marker["name"] for marker in Dataset(path).read_markers()))
    print(f"{path}: edfio reads {dict(there)}, wonambi {seen[path]}")
print("wonambi", meta.version("wonambi"), "edfio", meta.version("edfio"), "mne", meta.version("mne"))
still = seen == {"pulses.edf": {}, "mne.edf": {}, "pairs.edf": {"tap": 6, "tms": 1}}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
