#!/usr/bin/env bash
# dimep's MEP after Lewis is the largest swing up to twice its onset plus 30 ms: a later response is taken for it.
#
# Expected: docstring and source of lewis (Lewis and Perreault 2007): the largest peak-to-peak difference in the 30 ms that follow
#   the onset of the response.
# Seen: the onset is added to the window twice. An MEP of 193 uV at 20 ms is 953 uV once the EMG has a burst at 60 ms, though 30 ms
#   after the onset are over at 50 ms.
# Hurts: late responses, the end of the silent period and startle count as ipsilateral MEPs; the later the MEP the longer its
#   window.
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
from dimep.algo import lewis


def sweep(response, rate, offset=0.0):
    """0.3 s of EMG in uV, pulse at 0.15 s, noise with an SD of 2 uV."""
    time = np.arange(round(0.3 * rate)) / rate - 0.15
    return time, response(time) + offset + np.random.default_rng(3).normal(0, 2, time.size)


def biphasic(time, onset, duration, peak):
    inside = (time >= onset) & (time < onset + duration)
    return np.where(inside, peak * np.sin(2 * np.pi * (time - onset) / duration), 0.0)


seen = {}
for burst in (0, 500):
    time, emg = sweep(lambda time: biphasic(time, 0.020, 0.010, 100) + biphasic(time, 0.060, 0.010, burst), 1000)
    within = np.ptp(emg[(time > 0.0195) & (time < 0.0505)])
    seen[burst] = (round(float(lewis(emg, 150, 1000))), round(float(within)))
    print(f"burst of {burst} uV 60 ms after the pulse: MEP of {seen[burst][0]} uV; in the 30 ms from its onset {seen[burst][1]} uV")
print("dimep", meta.version("dimep"))
still = seen[0] == (193, 193) and seen[500][1] == 193 and seen[500][0] > 900
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
