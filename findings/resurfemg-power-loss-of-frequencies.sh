#!/usr/bin/env bash
# resurfemg's loss of power adds the spectrum's frequencies to its powers: a signal cut to a tenth has lost -0.0002 %.
#
# Expected: docstring of compute_power_loss: the percentage of power lost by the processing, by Welch's method. Half the
#   amplitude has a quarter of the power: 75 % are lost; a tenth 99 %; a muted signal 100 %.
# Seen: scipy's pair of frequencies and powers is summed as one, so that the frequencies (1 to 1000 Hz) outweigh the powers,
#   and the fraction is upside down (original by processed): the loss is a small negative number whatever the processing
#   did, and depends on the unit: -0.0001 % in millivolts, -1.5 % if the same EMG is given in units of 10 uV.
# Hurts: the check that a filter or an ECG removal has kept the EMG always passes.
# (The packages' own __init__ files, which import MNE and neurokit2, are left out.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps resurfemg==1.1.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

import numpy as np

root = meta.distribution("resurfemg").locate_file("resurfemg")
for name in ("resurfemg", "resurfemg.preprocessing"):
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__path__ = [str(root.joinpath(*name.split(".")[1:]))]
from resurfemg.preprocessing.filtering import compute_power_loss

RATE = 2000
emg = np.random.default_rng(1).normal(size=10 * RATE)
seen = {}
for unit in (1, 100):
    for left in (1.0, 0.5, 0.1, 0.0):
        loss = float(compute_power_loss(unit * emg, RATE, unit * left * emg, RATE))
        seen[unit, left] = loss
        print(f"{left:g} of the amplitude left, SD {unit}: true loss {100 * (1 - left**2):.0f} %, stated {loss:.4f} %")
print("resurfemg", meta.version("resurfemg"))
still = all(-0.01 < seen[1, left] <= 0 for left in (1.0, 0.5, 0.1, 0.0)) and -3 < seen[100, 0.5] < -1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
