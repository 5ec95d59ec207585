#!/usr/bin/env bash
# BioBSS takes the spectrum of the spectrum of skin conductance: a rhythm at 0.15 Hz has its power anywhere but at 0.1 to 0.2 Hz.
#
# Expected: docstring of eda_freq_features: f1sc, f2sc and f3sc are the spectral power at 0.1 to 0.2, 0.2 to 0.3 and 0.3 to 0.4 Hz, max_freq the
#   frequency with the highest power.
# Seen: the signal is transformed first, and Welch's spectrum is made of the transform, in which a rhythm is a short peak; the function has
#   no sampling rate at all. At 4 Hz rhythms of 0.15, 0.25 and 0.35 Hz have nearly the same power in all three bands, and max_freq is
#   another one than theirs.
# Hurts: sympathetic arousal by the power of 0.1 to 0.2 Hz or above: all numbers are of something else.
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
for name in ("biobss", "biobss.edatools"):  # without the plots and detectors that the package imports
    module = types.ModuleType(name)
    module.__path__ = [str(root.joinpath(*name.split(".")[1:]))]
    sys.modules[name] = module

import numpy as np
from biobss.edatools.eda_freqdomain import eda_freq_features
from scipy.signal import welch

RATE = 4
time = np.arange(300 * RATE) / RATE
noise = np.random.default_rng(1).normal(0, 0.01, time.size)
seen = {}
for number, rhythm_hz in enumerate((0.15, 0.25, 0.35)):
    signal = np.sin(2 * np.pi * rhythm_hz * time) + noise
    features = eda_freq_features(signal)
    bands = [float(features[f"eda_f{band}sc"]) for band in (1, 2, 3)]
    frequencies, power = welch(signal, RATE, nperseg=400)
    right = [float(power[(frequencies > low) & (frequencies < low + 0.1)].mean()) for low in (0.1, 0.2, 0.3)]
    shares = bands[number] / sum(bands), right[number] / sum(right)
    seen[rhythm_hz] = shares, float(features["eda_max_freq"])
    print(f"rhythm of {rhythm_hz} Hz: its own band has {shares[0]:.1%}, by Welch {shares[1]:.1%}; max_freq {seen[rhythm_hz][1]:.3f}")
print("biobss", meta.version("biobss"))
still = all(share < 0.6 and right > 0.95 for (share, right), _ in seen.values()) and all(abs(one - hz) > 0.05 for hz, (_, one) in seen.items())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
