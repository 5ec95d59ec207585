#!/usr/bin/env bash
# adskalman's smoother writes nan into the caller's data where a boolean array says that they are not valid.
#
# Expected: docstring of kalman_smoother: valid_data_idx are indices or a boolean array, and mean the same. Data that are handed
#   over are not changed; with indices they are copied first.
# Seen: with a boolean array there is no copy: the measured value of 30 is nan afterwards. With indices it is still 30.
# Hurts: a second look with other marks, or saving the data afterwards, finds the measurements gone; nothing is said.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps adskalman==0.3.12
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from adskalman.adskalman import kalman_smoother

one = np.eye(1)
seen = {}
for name, valid in (("indices", [0, 1, 3, 4]), ("booleans", np.array([True, True, False, True, True]))):
    data = np.array([[1.0], [2.0], [30.0], [4.0], [5.0]])
    smooth, _ = kalman_smoother(data, one, one, one, one, np.zeros(1), one, valid_data_idx=valid)
    seen[name] = (data.ravel().tolist(), smooth.ravel().round(2).tolist())
    print(f"valid by {name}: smoothed {seen[name][1]}, the caller's data afterwards {seen[name][0]}")
print("adskalman", meta.version("adskalman"))
still = seen["indices"][0][2] == 30 and np.isnan(seen["booleans"][0][2]) and seen["indices"][1] == seen["booleans"][1]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
