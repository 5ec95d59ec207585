#!/usr/bin/env bash
# biobabel's crop to an end alone sets all markers to infinity; each crop with a start moves them by a sample.
#
# Expected: docstring of Biodata.crop: tfrom is what is clipped from the beginning, tend the end point to which all data are
#   clipped, both may be left out; markers are updated with the data.
# Seen: without a start the start is minus infinity, which is subtracted from each marker: crop(tend=8) makes inf of all. With a
#   start the sample at the start is dropped, but the markers are counted from it: at 1000 Hz a pulse's marker is 1 ms behind its
#   artefact after one crop, 2 ms after two; at 10 Hz (respiration) 0.1 s.
# Hurts: stimuli of a cropped recording: they are not found at all, or are late against the signal.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 h5py==3.16.0 pyxdf==1.17.5 bioread==2025.5.2 pyedflib==0.1.42 \
    opensignalsreader==0.2.2 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps biobabel==1.1.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from biobabel.biodata import Biodata


def recording(rate):
    """Ten seconds with an artefact of one sample, and its marker, at 5 s."""
    one, data = Biodata(), np.zeros(10 * rate)
    data[5 * rate] = 1.0
    one.add_channel(({"id": "emg", "participant": "P", "sampling_frequency": rate, "modality": "emg", "units": "mV"}, data))
    one.markers = {"pulse": [5.0]}
    return one


def both(one):
    data = one.get("emg")[1]
    return round(float(one.get_time("emg")[data.argmax()]), 4), round(float(one.get_marker("pulse")[0]), 4)


seen = {}
for rate in (1000, 10):
    for case, crops in (("to 8 s", [{"tend": 8}]), ("1 to 8 s", [{"tfrom": 1, "tend": 8}]), ("1 s twice", [{"tfrom": 1}] * 2)):
        one = recording(rate)
        for crop in crops:
            one.crop(**crop)
        seen[rate, case] = both(one)
        print(f"{rate} Hz, cropped {case}: artefact at {seen[rate, case][0]} s, marker at {seen[rate, case][1]} s")
print("biobabel", meta.version("biobabel"))
still = seen[1000, "to 8 s"][1] == seen[10, "to 8 s"][1] == np.inf and seen[1000, "1 to 8 s"] == (3.999, 4.0)
still &= seen[1000, "1 s twice"] == (2.998, 3.0) and seen[10, "1 to 8 s"] == (3.9, 4.0)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
