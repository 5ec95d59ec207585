#!/usr/bin/env bash
# BioBSS's entropy of a spectrum has its sign and no probabilities: a tone has more than noise, and in other units less.
#
# Expected: docstring of acc_freq_features: fft_entropy is the entropy of the peaks of the FFT. Entropy is -sum p log p of shares p: about 0 for
#   a single frequency, log n for n equal ones, and the same in g and in mg.
# Seen: sum a log a of the amplitudes themselves. In g, noise has a large negative value and a tone about 0, thus more; in mg it is the
#   other way round.
# Hurts: entropy tells regular movement as walking from irregular: here it does so backwards, or by the unit.
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
from biobss.imutools.acc_freqdomain import acc_freq_features
from scipy.stats import entropy

rng = np.random.default_rng(1)
time = np.arange(0, 20, 0.02)
noise = rng.normal(0, 0.7, 1000)
tone = np.sin(2 * np.pi * 2 * time) + 1e-6 * noise
seen = {}
for name, signal in {"tone": tone, "noise": noise}.items():
    spectrum = np.abs(np.fft.rfft(signal))[1:-1]
    for unit, factor in (("g", 1), ("mg", 1000)):
        value = acc_freq_features([signal * factor], ["x"], 50)["x_fft_entropy"]
        seen[name, unit] = float(value), float(entropy(spectrum))
        print(f"{name} in {unit}: entropy {value:.1f}, by the definition {seen[name, unit][1]:.2f}")
print("biobss", meta.version("biobss"))
still = -1 < seen["tone", "g"][0] < 1 and seen["noise", "g"][0] < -20 and seen["noise", "mg"][0] > seen["tone", "mg"][0] > 5000 and seen["tone", "g"][1] < 0.1 and seen["noise", "g"][1] > 5.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
