#!/usr/bin/env bash
# pyriodic's circular median sorts the angles: of five angles around zero it is 10 degrees, one end of the data.
#
# Expected: docstring of circular_median: the median angle. A circular median (Fisher 1993, Zar) has half of the angles on each side, does
#   not depend on where zero is, and turns with the data.
# Seen: the angles are sorted from 0 to 2 pi and the middle one is taken. 350, 355, 0, 5 and 10 degrees have 10; turned by 90 degrees they
#   have 90, the middle. 41 angles within 40 degrees around zero have a median at the edge, 20 degrees from their mean.
# Hurts: phases around 0, as those at the peak of a rhythm; wherever the mean is near zero.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 pandas==2.2.3 lazy-loader==0.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps python-pyriodic==0.1.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pyriodic.desc import circular_mean, circular_median

around = np.array([350, 355, 0, 5, 10])
seen = {}
for turn in (0, 90, 180, 270):
    angles = np.deg2rad((around + turn) % 360)
    seen[turn] = round(float(np.rad2deg(circular_median(angles))), 6), round(float(np.rad2deg(circular_mean(angles))) % 360, 6) % 360
    print(f"{(around + turn) % 360} degrees: median {seen[turn][0]:.0f}, mean {seen[turn][1]:.0f}")
many = np.deg2rad(np.arange(-20, 21) % 360)
edge = round(float(np.rad2deg(circular_median(many))), 6)
print(f"-20, -19 to 20 degrees: median {edge:.0f}")
print("python-pyriodic", meta.version("python-pyriodic"))
still = seen == {0: (10.0, 0.0), 90: (90.0, 90.0), 180: (180.0, 180.0), 270: (270.0, 270.0)} and edge == 20.0
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
