#!/usr/bin/env bash
# EZ2 takes the variance of correct answers for that of errors: from exact moments it finds other drift rates.
#
# Expected: help of ez2_2afc: with correct_only=True, the default, the variances are "computed from correct responses only";
#   given a model's exact variances and error rates, the method of moments returns that model's parameters. cvrt says that it is
#   for the bottom boundary (errors) and that the top one needs a - z.
# Seen: it calls cvrt for the bottom boundary, so the variance of correct times is fitted with that of error times. Given the
#   variances of the errors, it returns the parameters. With the start in the middle both are the same, and it is right.
# Hurts: just the case that EZ2 is for, a bias to one answer: drift rates are 9 % too high for one kind of stimulus, 10 % too
#   low for the other, so a difference between kinds is found or changed; the start is drawn to the middle.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==2.3.3 EZ2==0.0.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import EZ2
import numpy as np

A = 0.12
times = np.linspace(1e-4, 8, 80001)


def variance(drift, start, top):
    density = EZ2.dddexit(times, drift, start, A, top_boundary=top)
    mean = np.trapezoid(times * density, times)
    return float(np.trapezoid((times - mean) ** 2 * density, times))


still = True
for drift_1, drift_2, start in ((0.2, 0.15, 0.06), (0.2, 0.15, 0.07), (0.15, 0.15, 0.075)):
    errors = float(EZ2.pe(drift_1, start, A)), float(EZ2.pe(drift_2, A - start, A))
    found = {}
    for case, top in (("correct", True), ("wrong", False)):
        moments = variance(drift_1, start, top), errors[0], variance(drift_2, A - start, top), errors[1]
        found[case] = EZ2.ez2_2afc(*moments).to_numpy()[0]
        print(f"true {drift_1} {drift_2} {start} {A}; from the {case} answers' variances {found[case].round(4)}")
    true = np.array([drift_1, drift_2, start, A])
    still &= bool(np.allclose(found["wrong"], true, rtol=1e-3))
    if start == A / 2:
        still &= bool(np.allclose(found["correct"], true, rtol=1e-3))
    else:
        still &= bool(found["correct"][0] > 1.08 * drift_1 and found["correct"][1] < 0.92 * drift_2)
print("EZ2", meta.version("EZ2"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
