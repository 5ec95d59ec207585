#!/usr/bin/env bash
# edgeofpy's third exponent of avalanches is its own inverse by least squares, and unrelated to durations by default.
#
# Expected: docstrings of dcc and fit_third_exponent: "the power law exponent of the relation between avalanche size and duration", which
#   dcc compares with (alpha - 1) / (tau - 1) (Ma et al. 2019; Friedman et al. 2012): the mean size grows as the duration to this
#   power, 2 for a critical branching process.
# Seen: "lsf" regresses the duration's logarithm on the size's: sizes that are durations to the power of 2 have 0.5. "pl", the
#   default, fits a distribution to the list of mean sizes and never looks at the durations: for powers of 1.2, 1.5 and 2 it is
#   1.34, 1.30 and 1.23, and the same if the durations are ten times as long.
# Hurts: the deviation from criticality of EEG and MEG: exactly critical avalanches deviate by 1.5 and 0.8, not by 0.
# (Needs a Python before 3.12, as it needs a pandas before 2.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==1.26.4 scipy==1.11.4 pandas==1.5.3 matplotlib==3.8.4 powerlaw==1.5 mpmath==1.3.0 neurokit2==0.2.10
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps edgeofpy==0.0.1
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import contextlib
import importlib.metadata as meta
import io
import sys

import numpy as np
from edgeofpy.avalanche import dcc, fit_third_exponent

durations = np.repeat(np.arange(2, 40), 20)
seen = {}
for power in (1.2, 1.5, 2.0):
    sizes = np.round(durations**power).astype(int)
    with contextlib.redirect_stdout(io.StringIO()):
        found = [
            float(fit_third_exponent(sizes, lasting, method=method))
            for method, lasting in (("lsf", durations), ("pl", durations), ("pl", 10 * durations))
        ]
    seen[power] = found
    print(f"size = duration to the power of {power}: lsf {found[0]:.2f}, pl {found[1]:.2f}, pl with durations ten times as long {found[2]:.2f}")
print(f"deviation of critical avalanches (tau 1.5, alpha 2, power 2): {float(dcc(1.5, 2, 2)):.2f}, with lsf's exponent {float(dcc(1.5, 2, seen[2.0][0])):.2f}")
print("edgeofpy", meta.version("edgeofpy"))
still = all(abs(lsf - 1 / power) < 0.05 and pl == ten for power, (lsf, pl, ten) in seen.items())
still &= seen[1.2][1] > seen[1.5][1] > seen[2.0][1]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
