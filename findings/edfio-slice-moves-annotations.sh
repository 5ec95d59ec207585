#!/usr/bin/env bash
# edfio moves all annotations against the signals when it slices a file that does not start on a whole second.
#
# Expected: docstring of slice_between_seconds: times count from the start of the recording, and the file is cut to an
#   interval between two of them. edfio's own onsets count from the first sample before the slice, whatever the fraction
#   of the start; an annotation on a sample stays on it.
# Seen: each slice adds the fraction of the start once to every onset. With a start at 10:00:00.25 the pulse at 15 s
#   lies, after a slice from 10 s, at 5 s in the signal and at 5.25 s among the annotations; after a second slice at
#   5.75 s. With a start on a whole second both agree. slice_between_annotations does the same.
# Hurts: a start taken from the clock has a fraction, half a second on average: each stimulus is marked so much after
#   its artefact, and a motor evoked potential is sought in the EMG of rest.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check edfio==0.4.18 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import datetime as dt
import importlib.metadata as meta
import sys

import edfio
import numpy as np

PULSES = (5.0, 15.0, 25.25, 35.0, 45.5)
emg = np.zeros(60_000)
emg[[round(pulse * 1000) for pulse in PULSES]] = 100.0  # the artefact of each pulse


def places(edf):
    marks = [round(mark.onset, 6) for mark in edf.annotations]
    return (np.flatnonzero(edf.signals[0].data > 50) / 1000).tolist(), marks


seen = {}
for microsecond in (0, 250_000):
    signal = edfio.EdfSignal(emg, 1000, label="FDI", physical_dimension="uV")
    marks = [edfio.EdfAnnotation(pulse, None, "tms") for pulse in PULSES]
    edf = edfio.Edf([signal], annotations=marks, starttime=dt.time(10, 0, 0, microsecond))
    steps = [places(edf)]
    for start, stop in ((10, 40), (10, 20)):
        edf.slice_between_seconds(start, stop)
        steps.append(places(edf))
    edf.write("sliced.edf")
    steps.append(places(edfio.read_edf("sliced.edf")))
    seen[microsecond] = steps
    print(f"start at 10:00:00 and {microsecond / 1e6} s:")
    for name, (artefacts, onsets) in zip(("whole", "10-40 s", "10-20 s of it", "written, read"), steps):
        print(f"  {name}: artefacts at {artefacts}, annotations at {onsets}")
print("edfio", meta.version("edfio"))
still = all(artefacts == onsets for artefacts, onsets in seen[0]) and seen[250_000][0] == seen[0][0]
still = still and seen[250_000][1] == ([5.0, 15.25, 25.0], [5.25, 15.5, 25.25])
still = still and seen[250_000][2] == seen[250_000][3] == ([5.25], [5.75])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
