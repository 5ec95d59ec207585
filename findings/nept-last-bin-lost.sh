#!/usr/bin/env bash
# nept's spike counts leave out the last bin: of 100 spikes in a second 90 are counted.
#
# Expected: docstring of bin_spikes: bins spikes from t_start to t_stop in steps of dt; ten bins of 0.1 s fill one second.
# Seen: without lastbin=True, which its docstring does not name, the last edge is one step before t_stop: nine bins, and what comes
#   after 0.9 s is not counted, in silence.
# Hurts: counts and rates of short trials are too low by a tenth with ten bins; a response in the last bin is lost.
# (Needs a Python before 3.13.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.11.4 matplotlib==3.9.4 shapely==2.0.7
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps nept==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import nept

train = nept.SpikeTrain(np.arange(0.005, 1, 0.01))
seen = {}
for step in (0.1, 0.25):
    counts = nept.bin_spikes([train], 0, 1, step, normalized=False)
    seen[step] = (int(counts.n_samples), int(round(float(np.sum(counts.data)))))
    print(f"100 spikes within 1 s, bins of {step} s: {seen[step][0]} bins with {seen[step][1]} spikes")
print("nept", meta.version("nept"))
still = seen == {0.1: (9, 90), 0.25: (3, 75)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
