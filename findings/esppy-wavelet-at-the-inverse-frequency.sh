#!/usr/bin/env bash
# esppy's time-frequency power is turned over: at 250 Hz a tone of 5 Hz is found at 17.7 Hz and one of 17.7 Hz at 5 Hz.
#
# Expected: docstring of compute_time_frequency: the power "for each frequency band and time point", with Morlet wavelets at the frequencies
#   given, at the sampling frequency sfreq. A tone of 5 Hz has most power at 5 Hz.
# Seen: 2 pi f is passed as the width of scipy's morlet2, whose frequency is w sfreq / (2 pi width): 14 sfreq / (4 pi^2 f), 88.7 Hz / f at
#   250 Hz. The sampling frequency is never used: at 500 Hz the same tone of 5 Hz is found elsewhere.
# Hurts: any time-frequency picture made with it: theta is beta and beta is theta.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps esppy==0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from esppy.analysis.time_frequency import compute_time_frequency

asked, found = np.arange(2, 60.1, 0.1), {}
for rate, tone in ((250, 5.0), (250, 17.7), (250, 9.4), (500, 5.0)):
    time = np.arange(0, 4, 1 / rate)
    power = compute_time_frequency(np.sin(2 * np.pi * tone * time), rate, asked)
    found[rate, tone] = round(float(asked[power[:, len(time) // 2].argmax()]), 1)
    print(f"tone of {tone} Hz at {rate} Hz: most power at {found[rate, tone]} Hz; 14 sfreq / (4 pi^2 f) = {14 * rate / (4 * np.pi**2 * tone):.1f} Hz")
print("esppy", meta.version("esppy"))
still = all(abs(seen - 14 * rate / (4 * np.pi**2 * tone)) < 0.6 for (rate, tone), seen in found.items())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
