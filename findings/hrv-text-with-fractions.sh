#!/usr/bin/env bash
# hrv reads intervals with decimals as two: 800.25 ms are a beat of 800 ms and one of 25 ms; 812.5 are 812.
#
# Expected: read_from_text reads RR intervals in ms from a text file with one column; the parser makes floats and takes a point.
# Seen: the pattern lets a point stand only after the first digit (0.8125 in seconds is read). Behind it, two or more decimals
#   become a further interval, a single one is dropped. Five intervals are read as eight; 1000.00 raises ValueError, for an
#   interval of 0.
# Hurts: intervals from an ECG sampled at 512 or 1024 Hz, or exported by other programs, have decimals: every false beat makes a
#   jump of 800 ms, so RMSSD is hundreds of ms, and the times run away.
# (Its import needs a Python before 3.10, or the name that the script puts back; numpy 1.26 one before 3.13.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 matplotlib==3.9.4 spectrum==0.10.0 hrv==0.2.10
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import collections
import collections.abc
import importlib.metadata as meta
import sys

collections.MutableMapping = collections.abc.MutableMapping
import numpy as np
from hrv.classical import time_domain
from hrv.io import read_from_text

seen = {}
for case, lines in (
    ("whole numbers", ["812", "800", "1000", "799", "801"]),
    ("decimals", ["812.5", "800.25", "1000.0", "798.75", "801.125"]),
    ("seconds", ["0.8125", "0.80025", "1.0", "0.79875", "0.801125"]),
):
    with open("rr.txt", "w") as file:
        file.write("\n".join(lines) + "\n")
    seen[case] = read_from_text("rr.txt").values
    print(f"{case}: {' '.join(lines)} are read as {seen[case]}")
rng = np.random.default_rng(1)
intervals = np.round((800 + np.cumsum(rng.normal(0, 5, 300))) * 1.024) / 1.024
intervals = intervals[intervals % 1 > 0]
np.savetxt("rr.txt", intervals, fmt="%.3f")
read = read_from_text("rr.txt")
right, found = np.sqrt(np.mean(np.diff(intervals) ** 2)), time_domain(read.values)["rmssd"]
print(f"{intervals.size} intervals at 1024 Hz, with three decimals: {len(read)} are read, RMSSD {found:.0f} ms for {right:.1f}")
with open("rr.txt", "w") as file:
    file.write("1000.00\n990.50\n")
try:
    raised = read_from_text("rr.txt").values
except ValueError as error:
    raised = str(error)
print(f"1000.00, 990.50: {raised}")
print("hrv", meta.version("hrv"))
still = seen["whole numbers"].tolist() == [812, 800, 1000, 799, 801] and len(seen["seconds"]) == 5
still &= seen["decimals"].tolist() == [812, 800, 25, 1000, 798, 75, 801, 125]
still &= isinstance(raised, str) and len(read) == 2 * intervals.size and bool(found > 10 * right)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
