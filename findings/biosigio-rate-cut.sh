#!/usr/bin/env bash
# biosigio cuts the sampling rate to a whole number when it exports to EDF: 4882.8125 Hz become 4882 Hz.
#
# Expected: EDF specification: a rate is samples per data record over the duration of a record, and records may last any
#   number of seconds, so that 4882.8125 Hz is exact with 78125 samples in 16 s (edfio and pyedflib write it so).
# Seen: to_edf writes 4882 samples for each record of one second and says nothing. The samples are the same, the
#   time between them is not: the file runs 0.017 % slow, 100 ms after ten minutes.
# Hurts: events are written in seconds of the true rate, so markers and EMG drift apart in one file: a pulse at ten minutes
#   is marked 100 ms (488 samples) before its artefact, further than any motor evoked potential lasts. Rates such as 4882.8125
#   or 24414.0625 Hz are those of common amplifiers (a clock divided by a power of two).
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    biosigio==1.2.13 pyedflib==0.1.42 edfio==0.4.18 numpy==2.4.6 pandas==3.0.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - 2>log <<'PY' || { cat log; exit 1; }
import contextlib
import importlib.metadata as meta
import io
import sys

import edfio
import numpy as np
from biosigio import Recording

rate, pulse_s = 4882.8125, 600.0
emg = np.zeros(int(rate * 608))
emg[int(pulse_s * rate)] = 1000.0  # the artefact
recording = Recording()
with contextlib.redirect_stdout(io.StringIO()):
    recording.add_channel("FDI", emg, rate, "uV", channel_type="EMG")
    recording.add_event(pulse_s, 0.0, "tms")
    recording.to_edf("emg.edf", format="edf")
edf = edfio.read_edf("emg.edf")
signal, mark = edf.signals[0], edf.annotations[0].onset
artefact = float(np.argmax(signal.data) / signal.sampling_frequency)
print(f"rate {rate} Hz in the recording, {signal.sampling_frequency} Hz in the file")
print(f"marker at {mark:.3f} s, artefact at {artefact:.3f} s")
print("biosigio", meta.version("biosigio"), "pyedflib", meta.version("pyedflib"))
still = signal.sampling_frequency == 4882 and 0.095 < artefact - mark < 0.105
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
