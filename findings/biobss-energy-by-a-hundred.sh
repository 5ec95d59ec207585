#!/usr/bin/env bash
# BioBSS's energy of acceleration is the sum of squares by a hundred, whatever the window's length: 1 g has 5 at 50 Hz, 10 at 100 Hz.
#
# Expected: docstring of acc_stat_features: energy is "the mean of sum of squares of the values in a window". Of a constant 1 g that is 1, at
#   any rate and in windows of any length.
# Seen: the sum is divided by 100, which is right for windows of 100 samples only. Ten seconds of 1 g have 2.5 at 25 Hz, 5 at 50 Hz and 10 at 100
#   Hz; a window twice as long has twice as much.
# Hurts: data of several devices, or windows of several lengths, in one table.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps biobss==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import importlib.util
import types
from pathlib import Path

root = Path(importlib.util.find_spec("biobss").origin).parent
for name in ("biobss", "biobss.imutools"):  # without the plots and detectors that the package imports
    module = types.ModuleType(name)
    module.__path__ = [str(root.joinpath(*name.split(".")[1:]))]
    sys.modules[name] = module

import numpy as np
from biobss.imutools.acc_statistical import acc_stat_features

seen = {}
for rate, seconds in ((25, 10), (50, 10), (100, 10), (100, 20), (100, 1)):
    signal = np.ones(rate * seconds)
    seen[rate, seconds] = float(acc_stat_features([signal], ["x"], rate)["x_energy"])
    print(f"1 g for {seconds} s at {rate} Hz: energy {seen[rate, seconds]:g}, mean of squares {np.mean(signal**2):g}")
print("biobss", meta.version("biobss"))
still = seen == {(25, 10): 2.5, (50, 10): 5.0, (100, 10): 10.0, (100, 20): 20.0, (100, 1): 1.0}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
