#!/usr/bin/env bash
# biomech-features' signal-to-noise ratio of an EMG is 0 dB whatever its noise is.
#
# Expected: docstring of compute_snr: "Signal-to-Noise Ratio (SNR) in dB". Contractions of 1 mV over a noise of 0.01 mV have
#   about 40 dB, over a noise of 1 mV about 0 dB.
# Seen: the "noise" is the standard deviation of the whole signal, contractions included, so that the ratio is that of the
#   power with and without the mean: 0.00 dB for all of them, as EMG has no mean; with an electrode's offset of 10 mV it is
#   18 dB.
# Hurts: a limit on the ratio excludes nothing, or, on raw data with an offset, keeps the channels with the largest offsets.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    biomech-features==0.1.1 numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from biomechfe.Featureset.EMG_statistical_features import compute_snr

rng = np.random.default_rng(1)
active = np.tile(np.repeat([0, 1], 1000), 10)
seen = []
for noise_mv, offset_mv in ((0.01, 0), (0.1, 0), (1.0, 0), (1.0, 10)):
    noise = rng.normal(size=active.size) * noise_mv
    emg = active * rng.normal(size=active.size) + noise
    emg += offset_mv - emg.mean()
    true = 10 * np.log10(np.mean((emg - emg.mean())[active == 1] ** 2) / np.mean((emg - emg.mean())[active == 0] ** 2) - 1)
    seen.append(round(float(compute_snr(emg)), 2))
    print(f"noise {noise_mv} mV, offset {offset_mv} mV: contractions to rest {true:.1f} dB, stated {seen[-1]:.2f} dB")
print("biomech-features", meta.version("biomech-features"))
still = seen[:3] == [0.0, 0.0, 0.0] and seen[3] > 15
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
