#!/usr/bin/env bash
# mne-xdf closes gaps of an XDF stream: every marker after a lost second of EMG is a second late against its pulse.
#
# Expected: XDF specification: each sample has a time stamp, and so has each marker. pyxdf reads both, and says where a new
#   segment begins. mne-xdf makes annotations of the markers; they lie where they were in the signal, or a gap is refused.
# Seen: samples are laid end to end, markers at their time since the first sample. After an interruption of the EMG of 2 s
#   every marker lies 2 s after its pulse. Nothing is raised or warned (pyxdf logs a line on segments), and the rate is right.
# Hurts: a wireless EMG that lost its connection once: all later sweeps are cut at the wrong place, often within the
#   pause between two pulses, so that no MEP is found in them.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mne-xdf==0.3.0 pyxdf==1.17.5 mne==1.13.2 numpy==2.4.6 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import importlib.metadata as meta
import struct
import sys
import warnings

import mne_xdf
import numpy as np
import pyxdf

PULSES = [2.0, 5.0, 12.0, 18.0]  # the EMG is interrupted from 8 to 10 s
RATE = 1000


def chunk(tag, content):
    return struct.pack("<BIH", 4, len(content) + 2, tag) + content


def stream(number, name, rate, form, samples):
    head = (
        f"<?xml version='1.0'?><info><name>{name}</name><type>x</type><channel_count>1</channel_count>"
        f"<nominal_srate>{rate}</nominal_srate><channel_format>{form}</channel_format></info>"
    )
    body = b"".join(struct.pack("<Bd", 8, 100 + time) + value for time, value in samples)
    clock = b"".join(chunk(4, struct.pack("<Idd", number, 100 + time, 0)) for time in (0, 5, 11, 20))
    count = struct.pack("<IBI", number, 4, len(samples))
    return chunk(2, struct.pack("<I", number) + head.encode()) + chunk(3, count + body) + clock


emg = [(at / RATE, struct.pack("<f", at / RATE in PULSES)) for at in range(20 * RATE) if not 8 <= at / RATE < 10]
marks = [(time, struct.pack("<BB3s", 1, 3, b"tms")) for time in PULSES]
with open("session.xdf", "wb") as file:
    file.write(b"XDF:" + chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>"))
    file.write(stream(1, "EMG", RATE, "float32", emg) + stream(2, "marks", 0, "string", marks))

one = pyxdf.load_xdf("session.xdf")[0][0]
by_pyxdf = (one["time_stamps"][one["time_series"][:, 0] > 0.5] - 100).round(3).tolist()
print("pulses at", PULSES, "; in pyxdf", by_pyxdf, "in segments", one["info"]["segments"])
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    raw = mne_xdf.read_raw_xdf("session.xdf", [1])
at = (np.flatnonzero(raw.get_data()[0] > 0.5) / raw.info["sfreq"]).round(3).tolist()
marked = raw.annotations.onset.round(3).tolist()
print("mne-xdf: pulses in the signal at", at, ", markers at", marked, ";", [str(warning.message) for warning in caught])
print("mne-xdf", meta.version("mne-xdf"), "pyxdf", meta.version("pyxdf"), "mne", meta.version("mne"))
still = by_pyxdf == PULSES and at == [2, 5, 10, 16] and marked == PULSES and not caught
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
