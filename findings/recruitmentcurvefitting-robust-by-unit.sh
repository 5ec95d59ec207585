#!/usr/bin/env bash
# RecruitmentCurveFitting's robust fit is robust in microvolts only: in millivolts two artefacts move the curve as without it.
#
# Expected: docstrings of Curve: robust=True fits with a soft-L1 loss, the default with the squares. The unit of the EMG is free;
#   in other units the heights are others, the midpoint, slope and floor (a proportion) are the same.
# Seen: the loss turns from squares to distances at a residual of 1, whatever the unit. On one curve with its midpoint at 54.4 two
#   sweeps with artefacts of 2.5 and 3 mV move it to 59.0, the robust fit in mV to 57.0, the robust fit in uV to 54.7.
# Hurts: recruitment curves of MEPs, M waves and H reflexes in mV or V: outliers count in full, and nothing says so.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps RecruitmentCurveFitting==1.2.8
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - 2>/dev/null <<'PY'
import contextlib
import importlib.metadata as meta
import io
import sys

import numpy as np

with contextlib.redirect_stdout(io.StringIO()):
    from RecruitmentCurveFitting import Sigmoid

rng = np.random.default_rng(2)
intensity = np.repeat(np.arange(30, 80, 5.0), 3)  # % of the stimulator's output
clean = np.abs(2 / (1 + np.exp(-4 * (intensity - 55) * 0.03)) + 0.02 + rng.normal(0, 0.05, intensity.size))  # mV
spoilt = clean.copy()
spoilt[[2, 8]] = 3.0, 2.5
seen = {}
for name, data in (("clean", clean), ("with two artefacts", spoilt)):
    for unit, factor in (("mV", 1), ("uV", 1000)):
        for robust in (False, True):
            with contextlib.redirect_stdout(io.StringIO()):
                fit = Sigmoid(intensity, data * factor, robust=robust).pdict
            seen[name, unit, robust] = float(fit["uShift"])
            print(f"{name}, {unit}, robust={robust}: midpoint {fit['uShift']:.2f}, floor {fit['uFloor']:.2f} of the height")
print("RecruitmentCurveFitting", meta.version("RecruitmentCurveFitting"))
name = "with two artefacts"
still = seen[name, "mV", True] > 56.5 and seen[name, "uV", True] < 55 and np.isclose(seen[name, "mV", False], seen[name, "uV", False], atol=0.05)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
