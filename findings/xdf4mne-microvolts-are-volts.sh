#!/usr/bin/env bash
# xdf4mne and pyxdf-mne hand over microvolts as volts: EEG of 50 uV is 50 V in MNE.
#
# Expected: MNE keeps EEG and EMG in volts; XDF's meta-data say for each channel what its unit is, here microvolts. Either the
#   reader converts, as it reads the unit, or says that it does not.
# Seen: both readers read the unit and do not use it: 50 uV are 50 V. xdf4mne takes every channel for EEG, EMG too. Nothing is
#   warned.
# Hurts: rejection limits, source estimates and exports are wrong by a million, and files joined with those of another reader hold
#   both.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 mne==1.13.2 pyxdf==1.17.5
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps xdf4mne==0.0.4 pyxdf-mne==0.0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import struct
import sys

import pyxdf_mne
import xdf4mne


def chunk(tag, content):
    return struct.pack("<BIH", 4, len(content) + 2, tag) + content


channels = "".join(
    f"<channel><label>{label}</label><type>{kind}</type><unit>microvolts</unit></channel>"
    for label, kind in (("Cz", "EEG"), ("FDI", "EMG"))
)
head = (
    "<?xml version='1.0'?><info><name>amplifier</name><type>EEG</type><channel_count>2</channel_count>"
    "<nominal_srate>1000</nominal_srate>"
    f"<channel_format>float32</channel_format><desc><channels>{channels}</channels></desc></info>"
)
samples = b"".join(struct.pack("<Bdff", 8, 100 + at / 1000, 50.0, 100.0) for at in range(1000))
with open("session.xdf", "wb") as file:
    file.write(b"XDF:" + chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>"))
    file.write(chunk(2, struct.pack("<I", 1) + head.encode()) + chunk(3, struct.pack("<IBI", 1, 4, 1000) + samples))

seen = {}
by_xdf4mne = xdf4mne.read_raw_xdf("session.xdf")
by_pyxdf_mne = pyxdf_mne.read_raw_xdf("session.xdf", "amplifier")
for name, raw in (("xdf4mne", by_xdf4mne), ("pyxdf-mne", by_pyxdf_mne)):
    seen[name] = (float(raw.get_data()[0, 0]), raw.get_channel_types())
    print(f"{name}: 50 uV are {seen[name][0]:g} V; EEG and EMG are {seen[name][1]}")
    print(name, meta.version(name))
still = [value for value, _ in seen.values()] == [50.0, 50.0] and seen["xdf4mne"][1] == ["eeg", "eeg"]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
