#!/usr/bin/env bash
# pyriodic returns the mean and the median of degrees in radians: of 80, 90 and 100 degrees the mean is 1.57.
#
# Expected: docstring of Circular: circular data in radians or degrees, with conversion between them; mean is the circular mean angle. That of
#   data in degrees is in degrees, since the method converts its result back when the unit is not radians.
# Seen: on reading, the range of degrees is replaced by that of radians, so that converting back changes nothing but the fourth digit:
#   the mean is 1.571, the median too. The resultant length, which has no unit, is "converted" as well: three equal angles have 1.0002.
# Hurts: phases or wrist angles in degrees: a mean of 1.6 degrees is believed; lengths are above one.
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

from pyriodic.circular import Circular

angles = Circular([80, 90, 100], unit="degrees")
mean, median = float(angles.mean()), float(angles.median())
length = float(Circular([40, 40, 40], unit="degrees").r())
radians = float(Circular([1.2, 1.4, 1.6], unit="radians").mean())
print(f"80, 90 and 100 degrees: mean {mean:.3f}, median {median:.3f}")
print(f"three angles of 40 degrees: resultant length {length:.5f}")
print(f"1.2, 1.4 and 1.6 radians: mean {radians:.3f}")
print("python-pyriodic", meta.version("python-pyriodic"))
still = abs(mean - 1.571) < 0.001 and abs(median - 1.571) < 0.001 and 1.0001 < length < 1.001 and abs(radians - 1.4) < 1e-9
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
