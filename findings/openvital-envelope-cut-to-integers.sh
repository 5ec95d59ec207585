#!/usr/bin/env bash
# openvital cuts the envelopes of the pulse wave to whole numbers: the variability index depends on the unit.
#
# Expected: the plethysmographic variability index is (max - min) / mean of the pulse's amplitude over a breath, a
#   percentage: the same wave in other units has the same index.
# Seen: both envelopes are written to arrays of integers. A wave with pulses that vary by 20 % has an index of 19 % if it
#   goes to 4000, 15 % if it goes to 20, 22 % if it goes to 5, and none at all from 0 to 1, as normalised ones do. Nothing
#   is raised.
# Hurts: indices from a normalised plethysmogram are missing or are multiples of a coarse step.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps openvital==0.2.1 openecg==0.11.0 opendsp==0.1.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from openvital.filters import pleth_pvi

RATE = 100
times = np.arange(40 * RATE) / RATE
pulses = 1 + 0.1 * np.sin(2 * np.pi * 0.25 * times)
wave = pulses * (0.5 + 0.5 * np.sin(2 * np.pi * 1.2 * times))
seen = {}
for top in (1, 5, 20, 4000):
    result = pleth_pvi.run({"PLETH": {"vals": top * wave, "srate": RATE}}, {}, dict(pleth_pvi.cfg))
    values = [float(value["val"]) for value in result[1]]
    seen[top] = round(float(np.median(values)), 1) if values else None
    print(f"pulses of {0.9 * top:g} to {1.1 * top:g}, by the definition 20 %: stated {seen[top]} % in {len(values)} breaths")
print("openvital", meta.version("openvital"))
still = seen[1] is None and seen[5] > 21.5 and seen[20] < 17 and 18.5 < seen[4000] < 20.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
