#!/usr/bin/env bash
# sensormotion drops minutes whose count lies between two whole numbers at a cut-point: the categories move up by one.
#
# Expected: docstring of cut_points: takes the counts of convert_counts and returns a list of categories "for each epoch".
#   Cut-points (sedentary to 99, light from 100) are for whole counts; convert_counts integrates, so its counts have decimals.
# Seen: a count of 99.5 is in no category and is left out without a word. Five epochs have four categories, and those behind it
#   belong to other minutes; the time spent adds up to less.
# Hurts: activity by the time of day, or beside another signal; which minutes are sedentary is wrong from the first such count.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 matplotlib==3.10.8 sensormotion==1.1.5
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from sensormotion.pa import convert_counts, cut_points

still = True
for size in (96.5, 97.0):
    milliseconds = np.arange(0, 300_001, 100)
    minute = np.minimum(milliseconds // 60_000, 4)
    wanted = np.array([50, size, 3000, 50, 9000])
    counts = convert_counts(wanted[minute] / 60, milliseconds, integrate="trapezoid")
    category, spent = cut_points(counts, "freedson_adult", 1)
    print(f"counts {counts.round(2)}: {category}, minutes in all {spent[1].astype(int).sum()}")
    still &= len(counts) == 5 and len(category) == (4 if size == 97 else 5)
    still &= (category == ["sedentary", "moderate", "sedentary", "vigorous"]) == (99 < counts[1] < 100)
print("sensormotion", meta.version("sensormotion"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
