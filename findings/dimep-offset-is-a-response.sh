#!/usr/bin/env bash
# dimep finds an MEP in noise after Lewis and Zewdie when the amplifier's offset is -40 uV; at +40 uV Lewis' MEP is cut.
#
# Expected: docstrings of lewis and zewdie: a response is what exceeds three standard deviations of the background EMG. An
#   amplifier's offset of some 10 uV is neither.
# Seen: the limit is the mean plus three SDs of the raw signal, and the absolute raw signal is compared with it. With an offset of
#   -40 uV the limit is below zero: each sweep of noise has an MEP of 9 uV for 0. With +40 uV an MEP of 124 uV that begins with a
#   negative half has 69 uV after Lewis, as that half is not seen.
# Hurts: without a high-pass filter the sign of the offset decides whether ipsilateral MEPs are present, in all sweeps of a channel
#   alike.
# (Needs a Python before 3.12, as it needs pkg_resources and a scipy before 1.10.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.23.5 scipy==1.9.3 setuptools==65.5.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps dimep==0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from dimep.algo import lewis, zewdie


def sweep(response, rate, offset=0.0):
    """0.3 s of EMG in uV, pulse at 0.15 s, noise with an SD of 2 uV."""
    time = np.arange(round(0.3 * rate)) / rate - 0.15
    return time, response(time) + offset + np.random.default_rng(3).normal(0, 2, time.size)


def biphasic(time, onset, duration, peak):
    inside = (time >= onset) & (time < onset + duration)
    return np.where(inside, peak * np.sin(2 * np.pi * (time - onset) / duration), 0.0)


seen = {}
for offset in (0, -40, 40):
    _, mep = sweep(lambda time: -biphasic(time, 0.020, 0.012, 60), 1000, offset)
    _, noise = sweep(lambda time: 0.0 * time, 1000, offset)
    seen[offset] = [round(float(one(emg, 150, 1000))) for emg in (mep, noise) for one in (lewis, zewdie)]
    print(f"offset {offset} uV: MEP of 124 uV by lewis and zewdie {seen[offset][:2]}, noise {seen[offset][2:]}")
print("dimep", meta.version("dimep"))
still = seen[0] == [124, 124, 0, 0] and seen[-40][:2] == [124, 124] and min(seen[-40][2:]) > 5 and seen[40][0] < 80
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
