#!/usr/bin/env bash
# pybv writes a comment with a comma as it is, and its file can then not be read.
#
# Expected: BrainVision Core Data Format 1.0: fields of a marker are parted by commas, and a comma in the type or the
#   description is coded as "\1". pybv writes that very rule as a comment into each .vmrk file, and follows it for
#   names of channels.
# Seen: the comment "coil moved, pair repeated" adds a field to its line. The position is then read from the wrong place:
#   MNE refuses the whole recording with "invalid literal for int()"; pybv itself does not complain when it writes.
# Hurts: an operator's free text, noted during a session, makes the recording unreadable afterwards.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check pybv==0.8.1 mne==1.13.2 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import mne
import numpy as np
import pybv

mne.set_log_level("ERROR")


def outcome(text, channel):
    pybv.write_brainvision(
        data=np.zeros((1, 1000)),
        sfreq=1000,
        ch_names=[channel],
        fname_base="emg",
        folder_out=".",
        events=[{"onset": 500, "type": "Comment", "description": text}],
        overwrite=True,
    )
    print([line for line in open("emg.vmrk", encoding="utf-8").read().splitlines() if line.startswith("Mk")])
    print([line for line in open("emg.vhdr", encoding="utf-8").read().splitlines() if line.startswith("Ch1=")])
    try:
        return list(mne.io.read_raw_brainvision("emg.vhdr").annotations.description)
    except ValueError as error:
        return f"ValueError: {error}"


plain = outcome("coil moved", "FDI, right")
comma = outcome("coil moved, pair repeated", "FDI, right")
print("without a comma:", plain, "\nwith a comma:   ", comma)
print("pybv", meta.version("pybv"), "mne", meta.version("mne"))
still = plain == ["Comment/coil moved"] and "invalid literal" in str(comma)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
