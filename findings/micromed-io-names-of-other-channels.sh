#!/usr/bin/env bash
# micromed-io gives channels the names in the order asked for, the data in that of the file: each has another's.
#
# Expected: docstring of create_mne_from_micromed_recording: sub_channels are the channels to pick from the recording; the result
#   contains the requested channels.
# Seen: the data come in the file's order and are named in the order of the list: ADM, APB, FDI are FDI, APB, ADM. Where the
#   marker channel (MKR) is not the last of the file, as in the headboxes with polygraphic channels behind it, it is not the
#   marker that is dropped again but another: FDI and ADM asked for are FDI and the marker's 50 mV; a warning speaks of
#   corrupt data.
# Hurts: EMG and EEG of Micromed recordings, silently, as soon as the channels are listed in an order of one's own.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mne==1.13.2 numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps micromed-io==0.4.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import logging
import struct
import sys
from pathlib import Path

import mne
import numpy as np
from micromed_io.to_mne import create_mne_from_micromed_recording

logging.disable(logging.WARNING)
mne.set_log_level("error")
levels = {"FDI": 100, "APB": 200, "ADM": 300, "MKR+": 50}  # uV, the marker's in mV
zones = "ORDER LABCOD NOTE FLAGS TRONCA IMPED_B IMPED_E MONTAGE COMPRESS AVERAGE HISTORY DVIDEO EVENT_A EVENT_B TRIGGER".split()


def trc(path, names):
    """A file of Micromed's System 98 with a constant level in each channel, 1 s at 256 Hz."""
    where = dict.fromkeys(zones, (8000, 0)) | {"ORDER": (640, 2 * len(names)), "LABCOD": (1000, 128 * len(names))}
    head = bytearray(9000)
    head[128:134] = bytes([1, 6, 125, 12, 0, 0])
    struct.pack_into("<hHIHHHHHH", head, 134, 0, 74, len(head), len(names), 0, 256, 2, 0, 0)
    head[175] = 4
    for index, zone in enumerate(zones):
        struct.pack_into("<8sII", head, 176 + 16 * index, zone.replace("_", " ", zone[:5] == "EVENT").ljust(8).encode(), *where[zone])
    for index, name in enumerate(names):
        struct.pack_into("<H", head, 640 + 2 * index, index)
        ground, unit = (b"MKR-", 1) if name == "MKR+" else (b"G2", 0)
        label = b"\1\0", name.encode(), ground, 0, 65535, 32768, -32768, 32768, unit
        struct.pack_into("<2s6s6siiiiih", head, 1000 + 128 * index, *label)
    samples = np.tile([32768 + levels[name] for name in names], 256).astype("<u2")
    path.write_bytes(bytes(head) + samples.tobytes())


full = {"FDI": "FDI-G2", "APB": "APB-G2", "ADM": "ADM-G2"}
seen = {}
for case, order in (("marker last", ["FDI", "APB", "ADM", "MKR+"]), ("marker second", ["FDI", "MKR+", "APB", "ADM"])):
    trc(Path("one.TRC"), order)
    for asked in (["FDI", "APB", "ADM"], ["ADM", "APB", "FDI"], ["FDI", "ADM"]):
        raw = create_mne_from_micromed_recording("one.TRC", [full[name] for name in asked], ch_types="emg")
        seen[case, tuple(asked)] = found = [round(float(one) * 1e6) for one in raw.get_data()[:, 0]]
        print(f"{case}: {dict(zip(asked, found))} uV, recorded {[levels[name] for name in asked]}")
print("micromed-io", meta.version("micromed-io"), "mne", mne.__version__)
still = seen["marker last", ("FDI", "APB", "ADM")] == [100, 200, 300] and seen["marker last", ("ADM", "APB", "FDI")] == [100, 200, 300]
still &= seen["marker second", ("FDI", "ADM")] == [100, 50000]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
