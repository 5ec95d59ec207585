#!/usr/bin/env bash
# grubbs numbers the second outlier in what is left after the first: taken from the data it is a good trial.
#
# Expected: docstring of detect_outliers(arr): Grubbs results for all outliers detected; of a result: the index of the outlier.
# Seen: the first outlier is deleted and the next is looked for in the shorter array, whose index is reported. Of 20 MEPs with
#   outliers at 3, 9 and 15 the indices are 3, 8 and 13: two of three deleted trials are good ones, two outliers stay.
# Hurts: whoever removes the trials by the index, as it is meant; the more outliers, the further beside.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps grubbs==0.0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from grubbs import detect_outliers

meps = np.random.default_rng(1).normal(1.0, 0.1, 20)  # mV
meps[[3, 9, 15]] = 9.0, 6.0, 4.0
found = detect_outliers(meps)
indices = [one["index"] for one in found]
print("outliers at [3, 9, 15], found at", indices, "of the data:", [round(float(meps[index]), 2) for index in indices])
left = np.delete(meps, indices)
print(f"largest of what is left after deleting them: {left.max():.2f} mV")
turned = meps.copy()
turned[[3, 9, 15]] = 4.0, 6.0, 9.0
backwards = [one["index"] for one in detect_outliers(turned)]
print("largest last:", backwards)
print("grubbs", meta.version("grubbs"))
still = indices == [3, 8, 13] and left.max() == 6.0 and backwards == [15, 9, 3]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
