#!/usr/bin/env bash
# ppg-features' perfusion index is the rise time of a pulse in samples: the same for any amplitude, and twice as much at twice the rate.
#
# Expected: docstring of perfusion_index: "The perfusion index as a percentage", that is the pulsatile part of the signal divided by the
#   constant part (AC / DC), as in every pulse oximeter.
# Seen: the places of peak and valley are subtracted, not the values there. The index is the number of samples between them divided by the
#   median of the signal: 0.1 % for pulses of 0.5 %, 4.5 % and 14 %, and it grows with the sampling rate.
# Hurts: studies of skin blood flow and of signal quality: a cold hand has the same index as a warm one.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps ppg-features==1.3.1 ecg-feature-selection==1.2.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from ppg_features import ppg_features

seen = {}
for amplitude, rate in ((100, 200), (1000, 200), (3000, 200), (1000, 400)):
    phase = 2 * np.pi * 1.2 * np.arange(0, 30, 1 / rate)
    pulses = 50000 + amplitude * (np.sin(phase) + 0.3 * np.sin(2 * phase))
    width, order = 5 * rate // 2 + 1, 80 * rate // 200
    filtered = ppg_features.filter_ppg(pulses, baseline_width=width)
    index = float(ppg_features.perfusion_index(filtered, pulses, peak_order=order, look_distance=100 * rate // 200))
    seen[amplitude, rate] = index
    print(f"amplitude {amplitude}, {rate} Hz: perfusion index {index:.3f} %, AC / DC {100 * np.ptp(pulses) / np.median(pulses):.2f} %")
print("ppg-features", meta.version("ppg-features"))
still = seen[100, 200] == seen[1000, 200] == seen[3000, 200] and 1.9 < seen[1000, 400] / seen[1000, 200] < 2.1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
