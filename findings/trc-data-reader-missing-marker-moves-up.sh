#!/usr/bin/env bash
# trc-data-reader: where a marker is missing, each later one takes the place of the one before it; its own files are read so, too.
#
# Expected: README: TRC data are read, processed and written; each marker has its coordinates at each frame. A marker that was not seen
#   has empty fields between tabs in a TRC file, which is also how save writes nan.
# Seen: lines are split at any white space, so that empty fields vanish: with the hip missing the knee is read as hip, the ankle as
#   knee, and the ankle is missing. What save writes of a table with nan comes back in the same way. There is no warning.
# Hurts: gait and reaching, where markers are hidden all the time: joints jump for single frames, or a whole step.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps c3d==0.6.0 trc-data-reader==0.4.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import math
import sys

from trc import TRCData

head = [
    "PathFileType\t4\t(X/Y/Z)\twalk.trc",
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
    "100\t100\t3\t3\tmm\t100\t1\t3",
    "Frame#\tTime\tHip\t\t\tKnee\t\t\tAnkle\t\t",
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\tX3\tY3\tZ3",
    "",
]
hip, knee, ankle, gap = "0\t0\t900", "0\t50\t500", "0\t80\t100", "\t\t"
frames = [(hip, knee, ankle), (gap, knee, ankle), (hip, gap, ankle)]
rows = [f"{number}\t{number / 100}\t" + "\t".join(frame) for number, frame in enumerate(frames, 1)]
data = TRCData()
data.parse("\n".join(head + rows), line_sep="\n")
for name in data["Markers"]:
    print(f"height of the {name.lower()} in three frames:", [one[2] for one in data[name]])

full = TRCData()
full.parse("\n".join(head + ["1\t0.01\t" + "\t".join(frames[0])] * 3), line_sep="\n")
full[1] = (0.01, [[math.nan] * 3, [0.0, 50.0, 500.0], [0.0, 80.0, 100.0]])  # the hip was not seen
full.save("again.trc")
again = TRCData()
again.load("again.trc")
print("written with the hip as nan and read again: hip", again["Hip"][0], "knee", again["Knee"][0])
print("trc-data-reader", meta.version("trc-data-reader"))
still = [one[2] for one in data["Hip"]] == [900, 500, 900] and [one[2] for one in data["Knee"]] == [500, 100, 100]
still &= again["Hip"][0] == [0.0, 50.0, 500.0]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
