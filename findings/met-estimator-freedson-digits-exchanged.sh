#!/usr/bin/env bash
# met-estimator's limit between moderate and vigorous by Freedson is 5274 for 5725: brisk walking is vigorous.
#
# Expected: docstring of freedson: Freedson's classification of activity from vertical counts. Freedson et al. (1998): light up to 1951 counts
#   a minute, moderate from 1952 to 5724, hard from 5725 on.
# Seen: two digits are exchanged, so that vigorous activity begins at 5274; moderate begins at 1951. The METs by the same paper, of
#   freedson_mets, are right: 5274 counts have 5.63 METs, where vigorous activity is said to begin at 6; 5725 have 5.99.
# Hurts: minutes of vigorous activity, which count twice in the WHO's recommendation.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps met-estimator==0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from met_estimator.cutpoints import freedson
from met_estimator.METs import freedson_mets

seen = {}
for count in (1951, 1952, 5273, 5274, 5724, 5725):
    seconds = [count] + [0] * 59  # one minute
    seen[count] = str(freedson(seconds)[0])
    right = "light" if count < 1952 else "moderate" if count < 5725 else "vigorous"
    print(f"{count} counts a minute: {seen[count]}, by the paper {right}; {float(freedson_mets(seconds)[0]):.2f} METs")
print("met-estimator", meta.version("met-estimator"))
still = seen[1951] == "moderate" and seen[5273] == "moderate" and seen[5274] == seen[5724] == seen[5725] == "vigourous"
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
