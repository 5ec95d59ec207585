#!/usr/bin/env bash
# meeglet's phase lag index is negative when the second channel leads, and its other half is whatever is in memory.
#
# Expected: docstring: the feature 'pli'. Stam, Nolte and Daffertshofer, Hum. Brain Mapp. 28 (2007): the absolute value of the mean sign of
#   the phase difference, from 0 to 1, and the same for two channels in either order.
# Seen: the absolute value is missing, and only one half of a matrix that was never filled is set before it is added to its own transpose. Two
#   channels with a lag of 20 ms have 1 or -1, or any number that was in memory, as has the diagonal. 'dwpli' is right.
# Hurts: connectivity of EEG: averages over pairs cancel, and persons differ by the order of the channels or by chance.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mne==1.10.1 numpy==1.26.4 scipy==1.13.1 matplotlib==3.10.8
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps meeglet==0.0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from meeglet import compute_spectral_features_array

rng = np.random.default_rng(1)
source = rng.normal(size=250 * 60 + 5)
early, late = source[5:] + 0.1 * rng.normal(size=250 * 60), source[:-5] + 0.1 * rng.normal(size=250 * 60)
seen = {}
for name, data in {"first leads": np.vstack([early, late]), "second leads": np.vstack([late, early])}.items():
    out, info = compute_spectral_features_array(data, 250, features=("pli", "dwpli"), foi_start=9, foi_end=9.5)
    seen[name] = [float(out.pli[0, 1, 0]), float(out.pli[1, 0, 0]), float(out.dwpli[0, 1, 0])]
    print(f"{name}, {info.foi[0]:.0f} Hz: PLI {seen[name][0]:.3g} and {seen[name][1]:.3g}, debiased weighted PLI {seen[name][2]:.2f}")
print("meeglet", meta.version("meeglet"))
right = all(0.9 < value <= 1 for values in seen.values() for value in values[:2])
still = not right and all(values[2] > 0.9 for values in seen.values())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
