#!/usr/bin/env bash
# emgflow's integrated EMG is multiplied by the sampling rate, not divided: at twice the rate the same EMG has four times as
#   much.
#
# Expected: an integral over time is the sum of the samples divided by the rate; calc_iemg ("integrated EMG") and calc_ssi
#   ("simple square integral") ask for the sampling rate. One second of 1 mV (rectified) has 1 mV s, at any rate.
# Seen: each sample is multiplied by the rate before it is summed: 1 mV s is 1000000 at 1 kHz, 4000000 at 2 kHz. The square
#   integral multiplies before it squares: 8 times as much at twice the rate.
# Hurts: muscles or sessions recorded at different rates (or decimated before) are compared by the square or cube of their
#   rates.
# (The package's own __init__, which imports its plots' web server, is left out.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps EMGFlow==1.1.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 tqdm==4.70.1 importlib-resources==6.5.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

import numpy as np
import pandas as pd

root = meta.distribution("EMGFlow").locate_file("EMGFlow")
sys.modules["EMGFlow"] = types.ModuleType("EMGFlow")
sys.modules["EMGFlow"].__path__ = [str(root)]
from EMGFlow.extract_features import calc_iemg, calc_ssi

seen = {}
for rate in (1000, 2000, 4000):
    times = np.arange(rate) / rate
    emg = np.pi / 2 * np.sin(2 * np.pi * 80 * times)  # 1 mV on average, rectified; one second
    frame = pd.DataFrame({"Time": times, "EMG": emg})
    true = np.abs(emg).sum() / rate, (emg**2).sum() / rate
    seen[rate] = float(calc_iemg(frame, "EMG", rate)), float(calc_ssi(frame, "EMG", rate))
    print(f"{rate} Hz: integral {true[0]:.3f} mV s, emgflow {seen[rate][0]:.3e}; of the square {true[1]:.3f} mV2 s, emgflow {seen[rate][1]:.3e}")
print("EMGFlow", meta.version("EMGFlow"))
ratios = [round(seen[2 * rate][kind] / seen[rate][kind], 1) for rate in (1000, 2000) for kind in (0, 1)]
print("twice the rate multiplies them by", ratios)
still = ratios == [4.0, 8.0, 4.0, 8.0] and 0.99e6 < seen[1000][0] < 1.01e6
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
