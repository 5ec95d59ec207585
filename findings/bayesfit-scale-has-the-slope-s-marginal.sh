#!/usr/bin/env bash
# bayesfit exchanges the marginals of threshold and slope: means and SDs are those of the other's probabilities.
#
# Expected: docstrings of extractMetrics: Mean is the mean of each parameter's own marginal of the posterior, SD its standard
#   deviation. Release notes: numpy up to 1.24.4, as here.
# Seen: the grid is made in numpy's default order, in which the first axis is the slope's, but is summed as if it were the
#   scale's (the threshold's). So the probabilities of the slopes are put on the values of the scale and the other way
#   round. Data with a threshold of 4 have a mean of 4.5 with an SD of 1.4, or a mean of 2.6, beside a MAP of 3.9; right
#   are 4.0 with an SD of 0.2.
# Hurts: thresholds and their uncertainty by estimate_type 'Mean', all plots of marginals, and (by the same axes) the
#   intervals; MAP is right.
# (numpy 1.24 needs a Python before 3.12.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.24.4 scipy==1.10.1 matplotlib==3.7.5 bayesfit==2.4.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import bayesfit
import numpy as np

LEVELS, TRIALS = np.arange(1, 8.0), np.full(7, 40)
still = True
for correct in ([20, 20, 22, 30, 38, 40, 40], [20, 21, 20, 33, 36, 40, 39]):
    metrics, _ = bayesfit.fitmodel(np.column_stack((LEVELS, correct, TRIALS)))
    scale, slope = metrics["Marginals_X"]["scale"], metrics["Marginals_X"]["slope"]
    both = metrics["posterior"].sum(axis=(2, 3))
    right = both.sum(axis=0) @ scale, both.sum(axis=1) @ slope  # numpy.meshgrid: slopes by row, scales by column
    spread = np.sqrt(both.sum(axis=0) @ (scale - right[0]) ** 2)
    print(f"{correct} of 40 at 1 to 7: MAP {metrics['MAP'][0]:.2f}, mean {metrics['Mean'][0]:.2f} (SD {metrics['SD'][0]:.2f});", end=" ")
    print(f"of the right axis {right[0]:.2f} (SD {spread:.2f})")
    still &= abs(metrics["MAP"][0] - right[0]) < 0.15 and abs(metrics["Mean"][0] - right[0]) > 0.5
    still &= metrics["SD"][0] > 3 * spread
    still &= np.isclose(metrics["Mean"][0], both.sum(axis=1) @ scale)
print("bayesfit", meta.version("bayesfit"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
