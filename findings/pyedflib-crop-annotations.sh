#!/usr/bin/env bash
# pyedflib's crop_edf drops every annotation of the file.
#
# Expected: docstring of highlevel.crop_edf: it crops a file to new start and stop times; the signals and header stay.
#   Annotations of the part that is kept stay with it, their onsets counted from the new start (EDF+ specification,
#   2.2.4: onsets count from the start of the file). drop_channels, rename_channels and anonymize_edf of the same module
#   keep all annotations.
# Seen: a file with five annotations, three of them in the part that is kept, has none after crop_edf. The function
#   reads the file again to check it, prints "Succesfully written file", and does not mention them.
# Hurts: stimuli of an EMG recording are its annotations. Cutting off the minutes before the first block, a usual first
#   step, leaves EMG without a single pulse, in a file that looks complete.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check pyedflib==0.1.42 edfio==0.4.18 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import edfio
import numpy as np
from pyedflib import highlevel

emg = edfio.EdfSignal(100 * np.sin(np.arange(60_000)), 1000, label="FDI", physical_dimension="uV")
pulses = [edfio.EdfAnnotation(onset, None, f"pulse {onset}") for onset in (5.0, 15.0, 25.0, 35.0, 45.0)]
edfio.Edf([emg], annotations=pulses).write("emg.edf")
highlevel.crop_edf("emg.edf", new_file="cropped.edf", start=10, stop=40, start_format="seconds", stop_format="seconds")
highlevel.rename_channels("emg.edf", {"FDI": "APB"}, new_file="renamed.edf")
left = {}
for name in ("emg.edf", "renamed.edf", "cropped.edf"):
    edf = edfio.read_edf(name)
    left[name] = [mark.onset for mark in edf.annotations]
    print(f"{name}: {edf.duration:.0f} s, annotations at {left[name]} s")
print("pyedflib", meta.version("pyedflib"), "edfio", meta.version("edfio"))
still = len(left["emg.edf"]) == len(left["renamed.edf"]) == 5 and left["cropped.edf"] == []
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
