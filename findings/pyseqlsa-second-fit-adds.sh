#!/usr/bin/env bash
# pyseqlsa's fit adds to what was fitted before: the second group's transitions are those of both groups.
#
# Expected: LSA(codes).fit(sequences) makes the table of transitions and their adjusted residuals of these sequences, as its example does;
#   the same sequences give the same table, whatever was fitted before.
# Seen: the counts are made once with the object and never set back: a second fit adds its own to them. Fitting the same sequences twice
#   doubles the counts and raises each residual by the root of 2. A group that alternates strictly has a residual of 1.88
#   for 3.00 if another was fitted before.
# Hurts: lag sequential analysis of behaviour in a loop over groups or persons: each has all before it in its table.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 pandas==3.1.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pyseqlsa==0.1.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pyseqlsa import LSA

first = [list("AABABBAABB"), list("ABBAABAABB")]
second = [list("ABABABABAB")]
analysis = LSA(["A", "B"])
seen = []
for sequences in (first, first, second):
    analysis.fit(sequences, output=False)
    alone = LSA(["A", "B"])
    alone.fit(sequences, output=False)
    seen.append((alone.transform_array.copy(), analysis.transform_array.copy(), float(alone.Z[0, 1]), float(analysis.Z[0, 1])))
    print(f"transitions {alone.transform_array.astype(int).tolist()}, after earlier fits {analysis.transform_array.astype(int).tolist()}; "
          f"residual A to B {alone.Z[0, 1]:.2f}, after earlier fits {analysis.Z[0, 1]:.2f}")
print("pyseqlsa", meta.version("pyseqlsa"))
still = np.array_equal(seen[1][1], 2 * seen[1][0]) and np.array_equal(seen[2][1], seen[2][0] + 2 * seen[0][0])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
