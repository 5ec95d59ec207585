#!/usr/bin/env bash
# neo gives EDF+ annotations that state no duration a duration of minus one second.
#
# Expected: EDF+ specification, section 2.2.2 (time-stamped annotations lists): the duration may be left out when it is
#   irrelevant or unknown. neo has Event for such moments; Epoch is for stretches with a duration.
# Seen: every annotation becomes an Epoch and the missing duration is -1 s, EDFlib's sign for "unused" taken for a time.
#   The list of events is empty. No warning.
# Hurts: triggers are nearly always written without duration. onset + duration lies a second before the pulse, so
#   cutting with neo's time_slice or testing for overlap gives the wrong second or none at all.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check neo==0.14.6 edfio==0.4.18 pyedflib==0.1.42 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import edfio
import neo
import numpy as np

emg = edfio.EdfSignal(np.sin(np.arange(5000)), 1000, label="FDI", physical_dimension="mV")
marks = [edfio.EdfAnnotation(1.0, None, "tms"), edfio.EdfAnnotation(3.0, 0.025, "pair")]
edfio.Edf([emg], annotations=marks).write("emg.edf")
again = edfio.read_edf("emg.edf").annotations
print("edfio:", [(mark.onset, mark.duration, mark.text) for mark in again])
segment = neo.io.EDFIO("emg.edf").read_block().segments[0]
epoch = segment.epochs[0]
durations = epoch.durations.rescale("s").magnitude
print("neo:  ", list(zip(epoch.times.rescale("s").magnitude, durations, epoch.labels)))
print("neo's events:", sum(len(event) for event in segment.events))
print("neo", meta.version("neo"), "edfio", meta.version("edfio"), "pyedflib", meta.version("pyedflib"))
still = again[0].duration is None and np.allclose(durations, [-1.0, 0.025]) and not sum(map(len, segment.events))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
