#!/usr/bin/env bash
# psignifit: credible intervals of thresholds below one half have their lower end above their upper end.
#
# Expected: the documentation of Result.threshold(): intervals for other proportions are made of the shallowest and the
#   steepest function, may be too wide ("only upper bounds"), and hold the estimate.
# Seen: for proportions below the fitted one the narrow width is used for the lower end and the large width for the
#   upper end, the right way round only above it. At 20 % of a plain yes/no data set the 95 % interval is upside down and
#   the estimate lies outside of it; the interval is also far too narrow, not too wide. No warning.
# Hurts: thresholds other than 50 % (safety limits at 10 or 20 % of responses, foot of a curve) come with an
#   interval that states a certainty which the data do not give.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check psignifit==4.3 numpy==2.4.6 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import psignifit

intensity = np.arange(30.0, 71.0, 5.0)  # % of the stimulator's output
pulses = np.full(intensity.size, 10)
responses = np.round(pulses / (1 + np.exp(-(intensity - 50) / 3))).astype(int)
result = psignifit.psignifit(
    np.column_stack([intensity, responses, pulses]), sigmoid="norm", experiment_type="yes/no"
)
rows = {}
for proportion in (0.2, 0.5, 0.8):
    estimate, intervals = result.threshold(np.array([proportion]))
    low, high = (float(np.ravel(end)[0]) for end in intervals["0.95"])
    rows[proportion] = (float(np.ravel(estimate)[0]), low, high)
    print(f"{proportion:.0%}: threshold {rows[proportion][0]:.2f}, 95 % interval from {low:.2f} to {high:.2f}")
print("psignifit", meta.version("psignifit"))
estimate, low, high = rows[0.2]
right = all(rows[p][1] < rows[p][0] < rows[p][2] for p in (0.5, 0.8))
still = right and low > high and not high <= estimate <= low
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
