#!/usr/bin/env bash
# respy finds no frame in which a signal is above a bound of 2 or more: a rating that reaches 9 is never above 2.
#
# Expected: docstring of activityCount: 'UBound' and 'LBound' detect events by Thresh, "a minimum value (scalar) for events measured in
#   frames": a frame is active if a value of the signal in it is above, or below, the threshold.
# Seen: a frame with such a value is set to 1, and then each that is less than the threshold to 0: with a threshold above 1 all are. Of a
#   signal from 1 to 9 every frame has a value above 1, and none above 1.001; none is below 8.
# Hurts: studies of shared activity in ratings, respiration or skin conductance: it depends on the unit, and in most is nothing.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps respy==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from respy.act import activityCount

time = np.arange(0, 120, 0.1)
ratings = pd.DataFrame({"one": 5 + 4 * np.sin(time), "two": 5 + 4 * np.sin(time + 1)}, index=time)
seen = {}
for kind, thresholds in {"UBound": (0.9, 1.0, 1.001, 2.0), "LBound": (0.9, 1.0, 2.0, 8.0)}.items():
    for threshold in thresholds:
        seen[kind, threshold] = float(activityCount(ratings, 7, 7, threshold, kind)["Total"].mean())
        beyond = ratings >= threshold if kind == "UBound" else ratings <= threshold
        right = float(np.mean([beyond.loc[start : start + 7].any().mean() for start in np.arange(0, 112, 7)]))
        print(f"{kind} {threshold}: {seen[kind, threshold]:.2f} of the frames of 7 s, by the signals {right:.2f}")
print("respy", meta.version("respy"))
still = seen["UBound", 1.0] > 0.9 and all(seen[key] == 0 for key in (("UBound", 1.001), ("UBound", 2.0), ("LBound", 2.0), ("LBound", 8.0)))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
