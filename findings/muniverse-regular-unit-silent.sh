#!/usr/bin/env bash
# muniverse reports a rate of zero for motor units that fire regularly: the more regular, the more intervals are dropped.
#
# Expected: docstring of get_basic_spike_statistics: mean firing rate and coefficient of variation of the intervals; pauses
#   in which the unit was inactive are left out.
# Seen: intervals longer than ten times their own standard deviation count as pauses. If the coefficient of variation is
#   below a tenth nearly all are longer: 10 Hz with 5 % is reported as 0 Hz with an infinite coefficient; at 10 % the
#   shorter half remains, and rate and coefficient are wrong.
# Hurts: steady contractions with feedback and simulated units have 5 to 15 %: the best units have no rate, or one that is
#   too high, and are dropped by any limit on the coefficient.
# (Only the module that computes is loaded: torch and the network parts are not needed.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps muniverse-emg==0.1.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

import numpy as np

root = meta.distribution("muniverse-emg").locate_file("muniverse")
for name in ("muniverse", "muniverse.evaluation"):
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__path__ = [str(root.joinpath(*name.split(".")[1:]))]
from muniverse.evaluation.evaluate import get_basic_spike_statistics

rng = np.random.default_rng(1)
seen = {}
for variation in (0.05, 0.10, 0.20):
    spikes = np.cumsum(rng.normal(0.1, 0.1 * variation, 400))
    intervals = np.diff(spikes)
    stated, rate = get_basic_spike_statistics(spikes)
    seen[variation] = (round(float(rate), 1), round(float(stated), 3))
    print(f"true {1 / intervals.mean():.1f} Hz, {intervals.std() / intervals.mean():.3f}: stated {seen[variation][0]} Hz, {seen[variation][1]}")
print("muniverse-emg", meta.version("muniverse-emg"))
still = seen[0.05] == (0.0, np.inf) and seen[0.10][0] > 10.4 and seen[0.10][1] < 0.08 and abs(seen[0.20][0] - 10) < 0.3
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
