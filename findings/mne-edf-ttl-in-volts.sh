#!/usr/bin/env bash
# MNE turns the voltages of an EDF channel named "Trigger" into codes: 5 V becomes event 4, an undershoot event 131071.
#
# Expected: EDF and EDF+ specifications: a stored number stands for the physical value between physical minimum and maximum, in
#   the unit of the channel's header. A recorded TTL line of 0 to 5 V is read as 0 to 5 V, as MNE does under other labels.
# Seen: by default a channel whose label is "Trigger" or "Status" is taken for a digital status channel of 17 bits: its
#   volts are cut to whole numbers (4.9999 to 4) and masked, so -1.2 V after the edge becomes 131071. find_events
#   then reports two kinds of event for one pulse, and nothing warns of it.
# Hurts: EMG systems that record the stimulator's TTL beside the muscle: each pulse counts twice, the second time at the
#   falling edge, as a condition that does not exist.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mne==1.13.2 edfio==0.4.18 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import edfio
import mne
import numpy as np

mne.set_log_level("ERROR")
volts = np.zeros(5000)
for pulse in (1000, 3000):
    volts[pulse : pulse + 10] = 5.0
    volts[pulse + 10 : pulse + 13] = -1.2  # the line swings back


def read(label):
    signal = edfio.EdfSignal(volts, 1000, label=label, physical_dimension="V", physical_range=(-10, 10))
    edfio.Edf([signal]).write("ttl.edf")
    raw = mne.io.read_raw_edf("ttl.edf", preload=True)
    values = np.unique(np.round(raw.get_data()[0], 3)).tolist()
    print(f"label {label!r}: type {raw.get_channel_types()[0]}, values {values}")
    return raw, values


_, plain = read("TTL in")
raw, codes = read("Trigger")
events = mne.find_events(raw)[:, [0, 2]].tolist()
print("two pulses were recorded; events (sample, code):", events)
print("mne", meta.version("mne"), "edfio", meta.version("edfio"))
still = plain == [-1.2, 0.0, 5.0] and codes == [0.0, 4.0, 131071.0]
still = still and events == [[1000, 4], [1010, 131071], [3000, 4], [3010, 131071]]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
