#!/usr/bin/env bash
# finnpy's downsampling gives another rate than the one asked for: 300 Hz are 299.8 Hz, of short signals 297 Hz.
#
# Expected: docstring of run: "downsamples a signal (data) from src_freq to tgt_freq".
# Seen: the data are padded to a power of two, and the number of samples of the padded data is cut to an integer: the rate is that
#   integer over the padded length. From 1000 to 300 Hz, 3 s of data come at 299.8 Hz and 0.1 s at 296.9 Hz. An
#   event at 2.9 s is 2 ms early, in seconds of the new rate; if the rates are powers of two apart it is right.
# Hurts: channels that were brought to one rate drift apart, EMG against a force or EEG that has it already.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps finnpy==2.0.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from finnpy.basic.downsampling import run


def measured(seconds, source, target, at_s):
    """When a smooth bump at a time is found, in s of the new rate, and the rate that makes it right."""
    time = np.arange(round(seconds * source)) / source
    lower = run(np.exp(-0.5 * ((time - at_s) / 0.005) ** 2), source, target)
    near = np.clip(lower, 0.1, None) - 0.1
    place = np.dot(near, np.arange(near.size)) / near.sum()
    return place / target, place / at_s


seen = {}
for case in ((3.0, 1000, 300, 2.9), (0.1, 1000, 300, 0.08), (3.0, 2000, 500, 2.9)):
    seconds, source, target, at_s = case
    found_s, rate = measured(*case)
    seen[case] = round(1000 * (found_s - at_s), 2), round(rate, 1)
    print(f"{seconds} s from {source} to {target} Hz: bump at {at_s} s is {seen[case][0]:+.2f} ms away, as at {seen[case][1]} Hz")
print("finnpy", meta.version("finnpy"))
shifts = [shift for shift, _ in seen.values()]
still = -2.1 < shifts[0] < -1.7 and -0.95 < shifts[1] < -0.7 and abs(shifts[2]) < 0.05
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
