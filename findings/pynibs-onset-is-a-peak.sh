#!/usr/bin/env bash
# pynibs gives the time of an MEP's first peak as its onset.
#
# Expected: docstring of calc_p2p: the third value is the "MEP onset after tms_pulse_time", where the MEP begins. (A latency of
#   a peak is another measure, some milliseconds later, and depends on the shape.)
# Seen: it is the time of the maximum or of the minimum in the search window, whichever is first. In a window without an
#   MEP it is the time of some sample of the noise, a number like the others.
# Hurts: latencies and central conduction times are late by the rise of the MEP, 2 and 4 ms in the example, so that a
#   slower MEP looks like a slower conduction.
# (pynibs is installed without its drawing and meshing packages, which this function does not need.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pynibs==0.2026.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==1.26.4 scipy==1.17.1 pandas==3.0.6 h5py==3.16.0 matplotlib==3.11.2 lmfit==1.3.4 tqdm==4.70.1 \
    scikit-learn==1.9.1 scikit-image==0.26.0 nibabel==5.4.2 meshio==5.3.5 trimesh==5.2.0 fslpy==3.29.1 transformations==2026.1.18
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pynibs.expio

RATE = 4000
after_ms = 1000 * (np.arange(1600) / RATE - 0.2)
seen = {}
for rise_ms in (2, 4):  # flat until 20 ms, then one period of a sine whose first peak is at 20 ms + rise_ms
    phase = (after_ms - 20) / (4 * rise_ms)
    sweep = np.where((phase > 0) & (phase < 1), 0.5 * np.sin(2 * np.pi * phase), 0.0)
    seen[rise_ms] = round(1000 * pynibs.expio.calc_p2p(sweep, 0.2, 18, 50, 0, RATE)[2], 2)
    print(f"MEP that begins at 20 ms and has its first peak at {20 + rise_ms} ms: onset {seen[rise_ms]} ms")
print("pynibs", meta.version("pynibs"), "numpy", meta.version("numpy"))
still = seen == {2: 22.0, 4: 24.0}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
