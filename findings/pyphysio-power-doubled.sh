#!/usr/bin/env bash
# pyphysio's power in a band is twice the power: all bands of white noise with variance 1 add up to 2.
#
# Expected: docstring of PowerInBand: the power in the frequency band. By Parseval's theorem the powers of all bands add up
#   to the variance; a sine of amplitude a has a^2 / 2.
# Seen: the one-sided density is divided by the number of its points, half of nfft, and multiplied by the whole sampling
#   rate: a sine of 1 mV has 1 mV^2, noise of variance 1 has 2, by both methods and at any rate.
# Hurts: powers of heart-rate bands, tremor or EMG are double those of other programs; ratios of bands are right.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pyphysio==4.10.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2 xarray==2026.9.0 dask==2026.8.0 pywavelets==1.9.0 scikit-learn==1.9.1 \
    pyxdf==1.17.5 h5py==3.16.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pyphysio as ph
from pyphysio.indicators.frequencydomain import PowerInBand

seen = {}
for rate in (100, 500):
    times = np.arange(60 * rate) / rate
    noise = np.random.default_rng(1).normal(size=times.size)
    for name, signal in (("sine of amplitude 1", np.sin(2 * np.pi * 10 * times)), ("noise of variance 1", noise)):
        made = ph.create_signal(signal, sampling_freq=rate)
        for method in ("welch", "period"):
            power = float(np.ravel(PowerInBand(0, rate / 2, method)(made).values)[0])
            seen[rate, name, method] = power / signal.var()
            print(f"{rate} Hz, {name}, {method}: variance {signal.var():.3f}, power of all frequencies {power:.3f}")
print("pyphysio", meta.version("pyphysio"))
still = all(1.8 < ratio < 2.2 for ratio in seen.values())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
