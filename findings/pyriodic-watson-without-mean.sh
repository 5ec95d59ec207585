#!/usr/bin/env bash
# pyriodic's Watson U2 lacks the mean of the differences: it is that of Cramer and von Mises, and depends on where zero is.
#
# Expected: docstring of watson_u2: the Watson U2 statistic of two circular samples. Watson (1962) subtracts the mean difference of the two
#   distribution functions, which makes it independent of the origin: turning both samples does not change it.
# Seen: the squared differences are summed as they are. Two samples 60 degrees apart have between 1.4 and 6.0 as both are turned together;
#   with the mean subtracted between 1.3 and 1.4, which is the grid's roughness.
# Hurts: comparisons of phases between conditions: the strength of a difference depends on which phase is called zero.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 tqdm==4.67.1 lazy-loader==0.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps python-pyriodic==0.1.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pyriodic.permutation import watson_u2

rng = np.random.default_rng(1)
first, second = rng.vonmises(0, 4, 60), rng.vonmises(np.pi / 3, 4, 60)
points = np.linspace(0, 2 * np.pi, 30)
seen, right = [], []
for turn in np.arange(0, 2 * np.pi, np.pi / 6):
    a, b = (first + turn) % (2 * np.pi), (second + turn) % (2 * np.pi)
    seen.append(float(watson_u2(a, b)))
    difference = np.array([np.mean(a <= point) - np.mean(b <= point) for point in points])
    right.append(float(np.sum((difference - difference.mean()) ** 2)))
print("both samples turned in steps of 30 degrees:", [round(one, 2) for one in seen])
print("with the mean difference subtracted:       ", [round(one, 2) for one in right])
print("python-pyriodic", meta.version("python-pyriodic"))
still = max(seen) > 2 * min(seen) and max(right) < 1.5 * min(right) and all(a > b for a, b in zip(seen, right))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
