#!/usr/bin/env bash
# mergait's universal symmetry index does not change its sign when left and right are exchanged, if one of them is negative.
#
# Expected: docstring of append_symmetry_index: the universal symmetry index, "which does allow negative values", of left and right. What is more
#   on the left is as much more on the right when the columns are exchanged: the index has the other sign, as it has for positive values.
# Seen: the angle is made of the quotient of left and right, in which the signs are lost. 2 and 1 have 0.45, 1 and 2 have -0.45; 2 and -1 have
#   -1.34, and -1 and 2 as well. Left -2 and right -1, where the right is more, has +0.45, as 2 and 1.
# Hurts: joint moments, rotations, medial and lateral forces: which side is more is wrong whenever the right is negative.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 pandas==2.2.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps mergait==0.0.8
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import pandas as pd
from mergait.symmetry import append_symmetry_index

pairs = [(2.0, 1.0), (2.0, -1.0), (-2.0, -1.0)]
seen = {}
for left, right in pairs:
    table = pd.DataFrame({"moment_left": [left, right], "moment_right": [right, left]})
    one, exchanged = append_symmetry_index(table, method="usi")["moment_usi"].round(2)
    seen[left, right] = float(one), float(exchanged)
    print(f"left {left:g}, right {right:g}: {one:.2f}; exchanged {exchanged:.2f}")
print("mergait", meta.version("mergait"))
still = seen == {(2.0, 1.0): (0.45, -0.45), (2.0, -1.0): (-1.34, -1.34), (-2.0, -1.0): (0.45, -0.45)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
