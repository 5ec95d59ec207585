#!/usr/bin/env bash
# spike2py filters resampled channels at the old rate: after 2000 to 500 Hz a low-pass of 20 Hz is one of 5 Hz.
#
# Expected: interp_new_fs: "interpolate values to a new sampling frequency"; lowpass(cutoff) is in hertz. Steps can be
#   chained, in any order.
# Seen: the new rate is not stored with the channel, whose filters divide by the old one. After 2000 to 500 Hz all cut-offs
#   are a quarter of what was asked for: of a 10 Hz tremor a low-pass of 20 Hz leaves 0.4 %, where it should leave all; after
#   500 to 2000 Hz they are four times as high.
# Hurts: every filter after a resampling, as is usual before channels of different rates are compared. Nothing is raised.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check spike2py==0.2.10 numpy==1.26.4 scipy==1.14.1 matplotlib==3.10.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from spike2py.channels import Waveform

about = {"units": "V", "path_save_figures": None, "trial_name": "t", "subject_id": "s"}


def left(rate, new_rate, tremor_hz, cutoff_hz, resample_first):
    times = np.arange(20 * rate) / rate
    channel = Waveform("hand", {"values": np.sin(2 * np.pi * tremor_hz * times), "times": times, "sampling_frequency": rate, **about})
    if resample_first:
        channel.interp_new_fs(new_rate).lowpass(cutoff_hz)
    else:
        channel.lowpass(cutoff_hz).interp_new_fs(new_rate)
    middle = channel.values[len(channel.values) // 4 : -len(channel.values) // 4]
    return round(float(np.sqrt(2 * np.mean(middle**2))), 2)


seen = {}
for rate, new_rate, tremor in ((2000, 500, 10), (500, 2000, 40)):
    seen[rate] = [left(rate, new_rate, tremor, 20, first) for first in (False, True)]
    print(f"{tremor} Hz, low-pass of 20 Hz, {rate} to {new_rate} Hz: filtered first {seen[rate][0]} is left, resampled first {seen[rate][1]}")
print("spike2py", meta.version("spike2py"))
still = seen[2000][0] > 0.95 and seen[2000][1] < 0.1 and seen[500][0] < 0.1 and seen[500][1] > 0.9
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
