#!/usr/bin/env bash
# BioBSS's power in a band is zero if one frequency is in it: of windows of ten seconds all of the slow movement is.
#
# Expected: docstrings of acc_freq_features and sig_power: f1sc, f2sc, f3sc are the signal's power from 0.1 to 0.2, 0.2 to 0.3 and 0.3 to 0.4 Hz.
#   A movement at 0.2 Hz with an amplitude of 1 has a power of 0.5, most of it near 0.2 Hz.
# Seen: the area under the density between the band's first and last frequency. The piece to the next band is in neither, so bands that
#   meet do not add up, and a band of one frequency, as with windows of 10 s, has a power of exactly 0.
# Hurts: these three features are taken of windows. At 10 s all three are 0 for every signal, at 20 s the sum for this movement is half of its power.
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
for name in ("biobss", "biobss.common", "biobss.imutools"):  # without the plots and detectors that the packages import
    module = types.ModuleType(name)
    module.__path__ = [str(root.joinpath(*name.split(".")[1:]))]
    sys.modules[name] = module

import numpy as np
from biobss.common.signal_psd import sig_psd, sig_power
from biobss.imutools.acc_freqdomain import acc_freq_features

seen = {}
for seconds in (10, 20, 60):
    signal = np.sin(2 * np.pi * 0.2 * np.arange(0, seconds, 1 / 12.8))
    features = acc_freq_features([signal], ["x"], 12.8)
    bands = [float(features[f"x_f{i}sc"]) for i in (1, 2, 3)]
    frequency, density = sig_psd(signal, 12.8)
    inside = (frequency > 0.0999) & (frequency < 0.3999)
    right = float(density[inside].sum() * frequency[1])
    seen[seconds] = bands, right
    print(f"{seconds} s: power {np.round(bands, 4)}, sum {sum(bands):.3f}, of 0.1 to 0.4 Hz by the same density {right:.3f}, variance {signal.var():.3f}")
print("biobss", meta.version("biobss"))
still = seen[10][0] == [0, 0, 0] and abs(sum(seen[20][0]) - 0.25) < 0.01 and sum(seen[60][0]) < 0.42 and all(abs(right - 0.5) < 0.02 for _, right in seen.values())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
