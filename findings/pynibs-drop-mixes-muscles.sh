#!/usr/bin/env bash
# pynibs drops a sweep from the first muscle only, and mixes the muscles in one row.
#
# Expected: docstring of get_mep_elements: drop_mep_idx says which MEPs to remove; amplitudes are of shape (N_channel,
#   N_stim). With two muscles and five sweeps, of which one is dropped: two rows of four.
# Seen: one row of nine. The sweep is dropped from the first muscle, stays in the second, and the muscles stand one behind
#   the other; the raw sweeps and the times are (2, 4) and 4. With two sweeps dropped the row has eight numbers, as many as
#   two muscles with four sweeps each.
# Hurts: amplitudes of a second muscle are paired with the times and coil positions of other sweeps.
# The file is laid out as CED Signal exports frames to MATLAB. (pynibs is installed without its drawing and meshing
# packages, which this function does not need.)
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
import contextlib
import importlib.metadata as meta
import io
import sys

import numpy as np
import scipy.io
from pynibs.expio.signal_ced import get_mep_elements

RATE = 4000
after_ms = 1000 * (np.arange(1600) / RATE - 0.2)
mep = 0.5 * (np.exp(-(((after_ms - 24) / 1.5) ** 2)) - np.exp(-(((after_ms - 28) / 1.5) ** 2)))
values = np.zeros((1600, 2, 5))  # samples, muscles, sweeps: 1 to 5 mV in the first muscle, 10 to 50 mV in the second
for sweep in range(5):
    values[:, 0, sweep], values[:, 1, sweep] = mep * (sweep + 1), 10 * mep * (sweep + 1)
frames = np.array([(5.0 * sweep, sweep + 1) for sweep in range(5)], dtype=[("start", "f8"), ("number", "i4")])
scipy.io.savemat("emg.mat", {"P01": {"points": 1600, "values": values, "interval": 1 / RATE, "start": 0.0, "frameinfo": frames}})
shapes, seen = {}, {}
for drop in (None, [2], [1, 3]):
    with contextlib.redirect_stdout(io.StringIO()):
        amplitudes, times, raw, *_ = get_mep_elements("emg.mat", 0.2, drop_mep_idx=drop, cfs_data_column=[0, 1])
    key = {None: "none", 1: "the third", 2: "two"}[drop and len(drop)]
    shapes[key] = (amplitudes.shape, len(times), raw.shape[:2])
    seen[key] = np.round(amplitudes).astype(int).tolist()
    print(f"dropped {key}: amplitudes {seen[key]} mV, {len(times)} times, raw sweeps {raw.shape}")
print("pynibs", meta.version("pynibs"), "numpy", meta.version("numpy"))
still = shapes == {"none": ((2, 5), 5, (2, 5)), "the third": ((9,), 4, (2, 4)), "two": ((8,), 3, (2, 3))}
still = still and seen["the third"] == [1, 2, 4, 5, 10, 20, 30, 40, 50]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
