#!/usr/bin/env bash
# hillfit cannot fit a response that falls: it returns a flat line, and says nothing.
#
# Expected: its documentation: "the parameterized data is fitted to the Hill equation"; x must rise, of y nothing is asked. Of a curve
#   that falls from 10 to 1 with half its effect at 10 the fit is exact with top and bottom exchanged, or a negative exponent.
# Seen: the exponent is kept above 0.01 and the top near the largest, the bottom near the smallest value, so that no falling curve is
#   possible: the exact data have EC50 0.1 (a tenth of the smallest dose), exponent 0.01 and an R² of 0.00. Rising, they are
#   fitted exactly.
# Hurts: inhibition: IC50 of a drug, or a response that decreases with the intensity of a conditioning pulse.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2 scikit-learn==1.9.1 sigfig==1.4.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps hillfit==0.1.7
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from hillfit import HillFit

dose = np.array([1.0, 2, 4, 8, 16, 32, 64])
rising = 1 + 9 * dose**2 / (10**2 + dose**2)
seen = {}
for what, response in (("rising", rising), ("falling", 11 - rising)):
    fit = HillFit(dose, response)
    fit.fitting(generate_figure=False)
    seen[what] = [round(float(value), 2) for value in (fit.ec50, fit.nH, fit.r_2)]
    print(f"{what} from {response[0]:.1f} to {response[-1]:.1f}, half at 10: EC50 {seen[what][0]}, exponent {seen[what][1]}, R² {seen[what][2]}")
print("hillfit", meta.version("hillfit"))
still = seen["rising"] == [10.0, 2.0, 1.0] and seen["falling"][0] < 1 and abs(seen["falling"][2]) < 0.1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
