#!/usr/bin/env bash
# mne-xdf takes millivolts for volts: an EMG in mV is a thousand times too large.
#
# Expected: XDF meta-data for EMG and EEG name the unit of each channel, "microvolts" for example. MNE holds EMG and EEG in
#   volts. mne-xdf reads the unit and converts; a unit that it does not know is refused or told.
# Seen: only microvolts are converted. "millivolts" and "mV" are volts, without a word, and the channel's unit in MNE is V.
# Hurts: MEPs of 1 mV are of 1 V; beside channels in microvolts in the same stream, ratios of muscles are wrong by a thousand,
#   and criteria such as 50 uV are met by every sweep.
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

UNITS = {"microvolts": 1000.0, "millivolts": 1.0, "mV": 1.0, "volts": 0.001}  # one millivolt in each


def chunk(tag, content):
    return struct.pack("<BIH", 4, len(content) + 2, tag) + content


channels = "".join(f"<channel><label>{unit}</label><type>EMG</type><unit>{unit}</unit></channel>" for unit in UNITS)
head = (
    f"<?xml version='1.0'?><info><name>EMG</name><type>EMG</type><channel_count>{len(UNITS)}</channel_count>"
    "<nominal_srate>1000</nominal_srate><channel_format>double64</channel_format>"
    f"<desc><channels>{channels}</channels></desc></info>"
)
row = struct.pack(f"<{len(UNITS)}d", *UNITS.values())
body = b"".join(struct.pack("<Bd", 8, 100 + at / 1000) + row for at in range(5000))
clock = b"".join(chunk(4, struct.pack("<Idd", 1, 100 + time, 0)) for time in (0, 5))
with open("session.xdf", "wb") as file:
    file.write(b"XDF:" + chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>"))
    file.write(chunk(2, struct.pack("<I", 1) + head.encode()) + chunk(3, struct.pack("<IBI", 1, 4, 5000) + body) + clock)
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    raw = mne_xdf.read_raw_xdf("session.xdf", [1])
seen = {}
for name, values, channel in zip(raw.ch_names, raw.get_data(), raw.info["chs"]):
    seen[name] = float(np.round(values[0], 9))
    print(f"1 mV in {name}: {seen[name]:g} of MNE's unit {channel['unit']!r}")
print("warnings:", [str(warning.message) for warning in caught])
print("mne-xdf", meta.version("mne-xdf"), "pyxdf", meta.version("pyxdf"), "mne", meta.version("mne"))
still = seen == {"microvolts": 0.001, "millivolts": 1.0, "mV": 1.0, "volts": 0.001} and not caught
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
