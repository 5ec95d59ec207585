#!/usr/bin/env bash
# dimep's MEP areas after Chen and Rotenberg are sums of samples: at 5 kHz they are five to ten times those at 1 kHz.
#
# Expected: docstrings: the area of the rectified EMG, and fs is the sampling rate; an area does not depend on it. The one after
#   Ziemann, in the same package, does not.
# Seen: samples are added and the rate is not used. Of the same MEP Rotenberg's area is 635 at 1 kHz and 3412 at 5 kHz, Chen's 380
#   and 3810; Ziemann's 372 and 370.
# Hurts: areas from two amplifiers are pooled or compared: one group has five times the MEP of the other.
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
from dimep.algo import chen, rotenberg, ziemann


def sweep(response, rate, offset=0.0):
    """0.3 s of EMG in uV, pulse at 0.15 s, noise with an SD of 2 uV."""
    time = np.arange(round(0.3 * rate)) / rate - 0.15
    return time, response(time) + offset + np.random.default_rng(3).normal(0, 2, time.size)


def biphasic(time, onset, duration, peak):
    inside = (time >= onset) & (time < onset + duration)
    return np.where(inside, peak * np.sin(2 * np.pi * (time - onset) / duration), 0.0)


seen = {}
for rate in (1000, 5000):
    _, emg = sweep(lambda time: biphasic(time, 0.020, 0.012, 100), rate)
    seen[rate] = {one.__name__: float(one(emg, round(0.15 * rate), fs=rate)) for one in (rotenberg, chen, ziemann)}
    print(f"{rate} Hz:", {name: round(area) for name, area in seen[rate].items()})
ratio = {name: seen[5000][name] / seen[1000][name] for name in seen[1000]}
print("5 kHz by 1 kHz:", {name: round(value, 2) for name, value in ratio.items()})
print("dimep", meta.version("dimep"))
still = ratio["rotenberg"] > 4.5 and ratio["chen"] > 4.5 and abs(ratio["ziemann"] - 1) < 0.05
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
