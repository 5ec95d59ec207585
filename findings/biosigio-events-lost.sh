#!/usr/bin/env bash
# biosigio keeps one event a second when it exports to EDF or BDF: the rest are gone, and it reports success.
#
# Expected: EDF+ specification, 2.2: a file holds any number of annotations; a writer reserves as much room in each data
#   record as they need. biosigio's Recording has all events, and to_edf is its documented way to EDF+ and BDF+.
# Seen: EDFlib, on which it writes, has room for one annotation a data record (one second) unless more is asked for, which
#   biosigio does not. Of 21 events in a 4-second recording 4 are in the file; nothing is raised or warned.
# Hurts: paired pulses, trains, or a pulse with its response and condition: every second with more than one
#   event loses some, and the late events of a dense recording are all lost.
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

recording = Recording()
printed = io.StringIO()
with contextlib.redirect_stdout(printed):
    recording.add_channel("FDI", 100 * np.sin(np.arange(4000)), 1000, "uV", channel_type="EMG")
    for pulse in range(20):
        recording.add_event(0.5 + 0.05 * pulse, 0.0, f"pulse {pulse}")
    recording.add_event(3.9, 0.0, "end of block")
    recording.to_edf("emg.edf", format="edf")
kept = [(mark.onset, mark.text) for mark in edfio.read_edf("emg.edf").annotations]
print(f"{len(recording.events)} events in the recording, {len(kept)} in the file: {kept}")
print("biosigio", meta.version("biosigio"), "pyedflib", meta.version("pyedflib"))
still = len(recording.events) == 21 and len(kept) == 4
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
