#!/usr/bin/env bash
# gait-profile-score takes the plain mean of the variables where the score is their root mean square.
#
# Expected: its description: calculates the gait profile score as stated in Baker et al. 2009. There the score of a side is the
#   root mean square of its nine variables' scores (each the RMS difference from the reference over the gait cycle), which
#   is the same as the RMS over all samples of all nine.
# Seen: the mean of the nine. A knee that is 27 degrees off beside eight right variables has a score of 3, not of 9. Only if
#   all variables are equally off is it right; else it is always too low.
# Hurts: scores cannot be compared with published ones (a change of 1.6 degrees is thought to matter), most where one
#   joint is affected; before and after a treatment of this joint the change is too small.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.2.6 scipy==1.17.1 pandas==2.3.3 matplotlib==3.10.8
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps gait-profile-score==1.0.2
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from gpscalculator import calculateGPS, exampleInputData

names = exampleInputData().kinematicVariables()
rng = np.random.default_rng(1)
reference = {name: 20 * np.sin(np.linspace(0, 2 * np.pi, 51)) for name in names}
seen = {}
for case, degrees in (
    ("one joint 27 degrees off", {"Knee Flexion Left": 27}),
    ("all 5 degrees off", dict.fromkeys(names, 5)),
    ("each by another amount", dict(zip(names, rng.exponential(6, len(names))))),
):
    subject = {name: list(reference[name] + degrees.get(name, 0)) for name in names}
    found = calculateGPS(reference, subject).gps["GPS Left"]
    left = np.array([degrees.get(name, 0) for name in names if "Left" in name])
    seen[case] = float(found), float(np.sqrt((left**2).mean())), float(left.mean())
    print(f"{case}: left score by Baker {seen[case][1]:.2f} degrees, the package's {seen[case][0]:.2f}")
print("gait-profile-score", meta.version("gait-profile-score"))
still = all(abs(found - mean) < 1e-9 for found, _, mean in seen.values())
still &= np.allclose(seen["one joint 27 degrees off"][:2], (3, 9)) and np.allclose(seen["all 5 degrees off"][:2], 5)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
