#!/usr/bin/env bash
# aind-ephys-utils' default smoothing is late by half its window: a response at 200 ms is at 225 ms.
#
# Expected: docstring of smooth: a boxcar or a Gaussian is laid over the signal, with a mode for both ends. Nothing is said of a
#   delay, and the Gaussian has none.
# Seen: the boxcar, which is the default and what psth uses, averages over the past only: with a window of 50 ms a response at 200
#   ms is at 225 ms. The boundary mode has no effect on it.
# Hurts: latencies of responses to a pulse are too late by a part of the smoothing, and differ between figures made with the two
#   methods.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 pandas==2.3.3 scipy==1.17.1 xarray==2025.6.1 \
    scikit-learn==1.9.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps aind-ephys-utils==0.4.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import xarray as xr
from aind_ephys_utils.ops.smooth import smooth

time = np.arange(500) / 1000
rate = xr.DataArray(np.exp(-(((time - 0.2) / 0.01) ** 2) / 2), dims="time", coords={"time": time})
seen = {}
for name, setting in (("boxcar", {"window": 0.05}), ("gaussian", {"sigma": 0.015})):
    smoothed = smooth(rate, method=name, **setting).values
    seen[name] = round(float(np.sum(time * smoothed) / np.sum(smoothed)) * 1000, 1)
    print(f"{name} {setting}: the response at 200 ms is at {seen[name]} ms")
edge = np.abs(smooth(rate, window=0.05, boundary="reflect").values - smooth(rate, window=0.05, boundary="constant").values).max()
print("aind-ephys-utils", meta.version("aind-ephys-utils"))
still = seen == {"boxcar": 224.5, "gaussian": 200.0} and edge == 0
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
