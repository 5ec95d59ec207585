#!/usr/bin/env bash
# pynibs returns the variance of the EMG before the pulse as its standard deviation.
#
# Expected: docstring of calc_emg_preactivation: "max-min and SD of the EMG timeseries before the TMS pulse"; the second
#   value is called sd.
# Seen: it is the variance: rest at an SD of 20 uV (0.02 mV) is 0.0004, a contraction at 200 uV is 0.04.
# Hurts: trials are rejected for contraction by a limit on the SD, such as 0.05 mV: none is, though the muscle contracts.
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

rng = np.random.default_rng(1)
seen = {}
for name, sd_mv in (("rest", 0.02), ("contraction", 0.2)):
    sweep = rng.normal(0, sd_mv, 1600)  # 0.4 s at 4000 Hz, the pulse is at 0.2 s
    told = pynibs.expio.calc_emg_preactivation(sweep, tms_pulse_time=0.2, sampling_rate=4000)[1]
    before = sweep[:800]
    seen[name] = (np.isclose(told, before.var()), np.isclose(told, before.std()), told < 0.05)
    print(f"{name}: pynibs's sd {told:.5f}; standard deviation {before.std():.5f} mV, variance {before.var():.5f} mV^2")
print("pynibs", meta.version("pynibs"), "numpy", meta.version("numpy"))
still = all(one == (True, False, True) for one in seen.values())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
