#!/usr/bin/env bash
# doepy with pandas 3 returns the numbers of the levels instead of the levels: 90, 110 and 130 % are 0, 1 and 2.
#
# Expected: its documentation: full_fact, plackett_burman, box_behnken and the fractional designs return a table with the levels of the
#   factors that were handed over.
# Seen: the levels are written into a row taken from the table, which since pandas 3 is a copy: nothing is written, and the
#   table keeps the place of each level, counted from 0. With pandas 2 the levels are there. The Latin hypercube, made another
#   way, is right.
# Hurts: a session run from the table: an intensity of 1 % and an interval of 0 ms are valid, and nothing is said.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
cat >design.py <<'PY'
import sys

import pandas as pd
from doepy import build

table = build.full_fact({"intensity_pct": [90, 110, 130], "isi_ms": [20, 40]})
other = build.plackett_burman({"intensity_pct": [90, 130], "isi_ms": [20, 40], "iti_s": [5, 8]})
print("pandas", pd.__version__, table.to_numpy().tolist(), other.iloc[0].tolist(), file=sys.stderr)
print(int(table.to_numpy().max()), int(other.to_numpy().max()))
PY
seen=""
for pandas in 2.3.3 3.1.1; do
    python3 -m venv "$tmp/$pandas"
    "$tmp/$pandas/bin/pip" install -q --disable-pip-version-check \
        numpy==2.3.5 scipy==1.16.3 pandas==$pandas pyDOE==0.3.8 diversipy==0.9
    "$tmp/$pandas/bin/pip" install -q --disable-pip-version-check --no-deps doepy==0.0.1
    seen+="$("$tmp/$pandas/bin/python" -W ignore design.py) "
done
"$tmp/3.1.1/bin/pip" list --disable-pip-version-check 2>/dev/null | grep -i "^doepy"
if [ "$seen" = "130 130 2 1 " ]; then
    echo "as described"
else
    echo "CHANGED: $seen"
    exit 1
fi
