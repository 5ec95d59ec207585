#!/usr/bin/env bash
# labbench-toolkit turns temporal summation round: pain that grows over the train has a negative summation.
#
# Expected: temporal summation of pain is the rating of the last stimuli of a train minus that of the first; in cuff
#   algometry, which this class reads, VAS-I is the mean of the first ones, VAS-III of the last, and TS = VAS-III - VAS-I.
# Seen: VAS1 is the mean of the last three responses and VAS3 that of the first three. Ratings that rise from 1 to 5.5 have
#   TS = -3.5; ratings that fall have a positive one.
# Hurts: the sign of every person's temporal summation, and of its change by a treatment such as brain stimulation.
# (The data file is written by the script; only the fields that are read are in it.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check labbench-toolkit==0.0.4 numpy==2.4.6 matplotlib==3.11.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import json
import sys

from labbench_toolkit.io import DataFile

rising = [1.0 + 0.5 * stimulus for stimulus in range(10)]
responses = {"RISING": rising, "FALLING": rising[::-1]}
session = {
    name: {"ID": name, "Type": "AlgometryTemporalSummationResult", "Completed": True, "Responses": values} for name, values in responses.items()
}
with open("sessions.json", "w") as file:
    json.dump({"id": ["S01"], "data": [session]}, file)
seen = {}
for name, values in responses.items():
    result = DataFile("sessions.json")[0][name]
    seen[name] = (result.VAS1, result.VAS3, result.TS)
    print(f"ratings from {values[0]} to {values[-1]}: VAS-I {result.VAS1}, VAS-III {result.VAS3}, temporal summation {result.TS}")
print("labbench-toolkit", meta.version("labbench-toolkit"))
still = seen == {"RISING": (5.0, 1.5, -3.5), "FALLING": (1.5, 5.0, 3.5)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
