#!/usr/bin/env bash
# neuroanalysis' adaptive detrend leaves the trend where it was: a drift of 100 remains 100.
#
# Expected: docstring of adaptive_detrend: a linear detrend, the baseline being estimated without outliers.
# Seen: the line is fitted to data that have been detrended already, so that it is flat, and that flat line is subtracted from the
#   raw data. A drift of 100 over the recording is 100 afterwards; scipy's detrend leaves 0.
# Hurts: baselines drift on as before, and thresholds against them find events at one end of the recording only.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps neuroanalysis==0.0.7
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from neuroanalysis.baseline import adaptive_detrend
from scipy.signal import detrend

signal = np.linspace(0, 100, 1000) + np.random.default_rng(1).normal(size=1000)


def drift(data):
    return round(float(np.polyfit(np.arange(1000), data, 1)[0] * 1000))


seen = (drift(signal), drift(adaptive_detrend(signal.copy())), drift(detrend(signal)))
print(f"drift {seen[0]}; after adaptive_detrend {seen[1]}; after scipy's detrend {seen[2]}")
print("neuroanalysis", meta.version("neuroanalysis"))
still = seen == (100, 100, 0)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
