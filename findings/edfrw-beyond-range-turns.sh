#!/usr/bin/env bash
# edfrw turns a value above the range into one at the other end: a pulse artefact of 5.1 mV is written as -4.9 mV.
#
# Expected: phys_to_dig converts a physical value to the digital one of EDF, 16 bits with a sign; a value beyond the
#   physical range is written as its limit, or refused.
# Seen: the number is cut to 16 bits: beyond the maximum it begins again at the minimum.
# Hurts: stimulus artefacts and saturated channels: a peak becomes a spike of the opposite sign, twice the range from peak
#   to peak; nothing is raised.
# (The reader, which needs a numpy of 2023, is left out.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps edfrw==1.0.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

import numpy as np

sys.modules["edfrw"] = types.ModuleType("edfrw")
sys.modules["edfrw"].__path__ = [str(meta.distribution("edfrw").locate_file("edfrw"))]
from edfrw.headers import EdfSignal

signal = EdfSignal(
    label="EMG", physical_dim="mV", physical_min=-5, physical_max=5, digital_min=-32768, digital_max=32767, sampling_freq=1000
)
seen = {}
for value in (4.9, 5.0, 5.1, 9.0):
    stored = np.array([signal.phys_to_dig(np.array([value]))], dtype=np.uint16).view(np.int16)
    seen[value] = round(float(signal.dig_to_phys(stored)[0, 0]), 2)
    print(f"{value} mV in a range of -5 to 5 mV: written and read again {seen[value]} mV")
print("edfrw", meta.version("edfrw"))
still = seen == {4.9: 4.9, 5.0: 5.0, 5.1: -4.9, 9.0: -1.0}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
