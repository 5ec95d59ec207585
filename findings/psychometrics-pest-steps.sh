#!/usr/bin/env bash
# psychometrics' PEST does not double its steps: the third in one direction is 6 and the fourth 8, whatever they were before.
#
# Expected: PEST (Taylor and Creelman, 1967): the second step in one direction is as large as the first, the fourth and each
#   further one twice the one before (up to a maximum), the third the same or twice. Steps get no smaller before the direction
#   turns.
# Seen: instead of the step, the number of steps in this direction is doubled. From a first step of 16 right answers lead to
#   steps of 16, 6, 8, 10 and 12, from one of 32 to 32, 6, 8, 10 and 12.
# Hurts: who begins far from the threshold needs many more trials to get near, and which unit the levels have decides how many:
#   steps of 6 to 14 in mV or in V.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 matplotlib==3.10.8 psychometrics==0.1.2
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from psychometrics.Hybrid import Hybrid
from psychometrics.PEST import PEST

seen = {}
for case, procedure in (("PEST, first step 16", PEST(init_dx=16)), ("PEST, first step 32", PEST(init_dx=32)), ("Hybrid, least step 5", Hybrid(min_dx=5))):
    level, steps = 500.0, []
    while len(steps) < 6:
        following = procedure.update(True, level)
        if following != level:
            steps.append(level - following)
        level = following
    seen[case] = steps
    print(f"{case}: with right answers only, steps down of {' '.join(f'{step:g}' for step in steps)}")
print("psychometrics", meta.version("psychometrics"))
still = seen["PEST, first step 16"] == [16, 6, 8, 10, 12, 14] and seen["PEST, first step 32"] == [32, 6, 8, 10, 12, 14]
still &= seen["Hybrid, least step 5"] == [20, 6, 8, 10, 12, 14]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
