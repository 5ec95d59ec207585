#!/usr/bin/env bash
# neuroanalysis leaves out a recording's last sample in each slice that ends with it: halves of 1000 have 500 and 499.
#
# Expected: docstring of time_slice: stop is the time at the end of the slice, not included. From 0.5 s to 1 s a recording of 1 s at
#   1 kHz has 500 samples.
# Seen: the index of stop is held at the last sample, which is then left out. The second half has 499 samples, and so has a slice to
#   2 s; only None gives all.
# Hurts: sweeps cut at regular times have one sample too few at the end of each recording: they cannot be stacked, or all lose one.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps neuroanalysis==0.0.7
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from neuroanalysis.data import TSeries

series = TSeries(np.arange(1000.0), sample_rate=1000)
seen = {}
for start, stop in ((0.0, 0.5), (0.5, 1.0), (0.5, 2.0), (0.5, None)):
    part = series.time_slice(start, stop)
    seen[start, stop] = len(part)
    print(f"from {start} to {stop} s: {len(part)} samples, the last is {part.data[-1]:.0f}")
print("neuroanalysis", meta.version("neuroanalysis"))
still = list(seen.values()) == [500, 499, 499, 500]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
