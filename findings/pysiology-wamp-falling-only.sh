#!/usr/bin/env bash
# pysiology's Willison amplitude counts falling steps only: half of them, or none.
#
# Expected: docstring of getWAMP: how often the difference between two neighbours exceeds a threshold, by the formula
#   sum(f(|x[i] - x[i+1]|)): upwards and downwards.
# Seen: the difference is taken without its absolute value, so that only steps down count. A square wave with 99 steps has
#   49, a staircase with five steps up none, and with its electrodes swapped (all signs turned) five.
# Hurts: the count, a measure of how many motor units fire, is half of what the definition gives, and depends on which
#   electrode is the positive one; a sharp rise and slow fall of each potential makes it anything.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    pysiology==0.0.9.71 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2 peakutils==1.3.5 setuptools==75.8.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pysiology.electromyography import getWAMP

sharp_rise = np.tile([0.0, 1.0, 0.75, 0.5, 0.25], 20)  # 1 up, 0.25 down
signals = {"square wave": np.tile([0.0, 1.0], 50), "stairs": np.repeat(np.arange(6.0), 3), "sharp rise, slow fall": sharp_rise}
seen = {}
for name, emg in signals.items():
    defined = int(np.sum(np.abs(np.diff(emg)) >= 0.5))
    seen[name] = (defined, int(getWAMP(list(emg), 0.5)), int(getWAMP(list(-emg), 0.5)))
    print(f"{name}: {seen[name][0]} steps of 0.5 or more; pysiology {seen[name][1]}, of the turned signal {seen[name][2]}")
print("pysiology", meta.version("pysiology"))
still = seen == {"square wave": (99, 49, 50), "stairs": (5, 0, 5), "sharp rise, slow fall": (20, 0, 20)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
