#!/usr/bin/env bash
# BioBSS's power spectrum by "fft" has twice the power: a sine of amplitude 1 has 1 in its band, by "welch" the half that it has.
#
# Expected: docstring of sig_psd: the power spectral density by "welch" or "fft"; sig_power is the power in a range of it. By Parseval's theorem
#   all of it is the variance, which is 0.5 for a sine of amplitude 1.
# Seen: by "fft" one-sided amplitudes, already doubled, are squared, which makes four times the two-sided power where it should be twice. Noise
#   of variance 4 has 8, by Welch 4.
# Hurts: bands of HRV or EEG by the one method beside norms, or beside the other.
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
for name in ("biobss", "biobss.common"):  # without the plots and detectors that the package imports
    module = types.ModuleType(name)
    module.__path__ = [str(root.joinpath(*name.split(".")[1:]))]
    sys.modules[name] = module

import numpy as np
from biobss.common.signal_psd import sig_power, sig_psd

RATE = 100
time = np.arange(0, 60, 1 / RATE)
rng = np.random.default_rng(1)
signals = {"sine of amplitude 1": np.sin(2 * np.pi * 5 * time), "noise of variance 4": rng.normal(0, 2, time.size)}
seen = {}
for name, signal in signals.items():
    for method in ("welch", "fft"):
        frequencies, density = sig_psd(signal, RATE, method=method)
        seen[name, method] = float(sig_power(density, frequencies, [0, RATE / 2])) / float(np.var(signal))
    print(f"{name}: variance {np.var(signal):.2f}; of it by welch {seen[name, 'welch']:.2f}, by fft {seen[name, 'fft']:.2f} times")
print("biobss", meta.version("biobss"))
still = all(abs(value - (2 if method == "fft" else 1)) < 0.1 for (_, method), value in seen.items())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
