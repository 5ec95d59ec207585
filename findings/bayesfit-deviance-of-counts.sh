#!/usr/bin/env bash
# bayesfit's measures of fit take counts for proportions: the deviance is negative, and a bad fit can have 0.
#
# Expected: docstring of deviance: a metric of goodness of fit, that of a binomial model: never negative, 0 only if the
#   model gives each proportion exactly; docstring of pearson_chisqr: Pearson's chi-squared, so the sum of
#   (correct - expected)^2 / variance over correct and wrong answers.
# Seen: the formula for proportions gets the numbers of correct answers, and expected numbers rounded to whole trials. A
#   fit whose deviance is 6.2 has one of -1.1; wrong answers are left out of chi-squared, which is 0.65 for 10.4, and
#   0.33 for 97.
# Hurts: fits cannot be compared or rejected: chi-squared against its distribution never rejects a model of a psychometric
#   function, whose errors lie near 100 % correct.
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
from scipy.special import xlogy

LEVELS, TRIALS = np.arange(1, 8.0), np.full(7, 40.0)
seen = []
for correct in ([20, 21, 20, 33, 36, 40, 39], [22, 20, 20, 30, 40, 38, 40], [20, 20, 22, 30, 38, 40, 40]):
    correct = np.array(correct, float)
    metrics, options = bayesfit.fitmodel(np.column_stack((LEVELS, correct, TRIALS)))
    alpha, beta = metrics["MAP"][:2]
    gamma, lapse = options["param_ests"][2:]
    share = gamma + (1 - lapse - gamma) / (1 + np.exp(-beta * (LEVELS - alpha)))
    wrong, expected = TRIALS - correct, TRIALS * share
    deviance = 2 * (xlogy(correct, correct / expected) + xlogy(wrong, wrong / (TRIALS - expected))).sum()
    pearson = ((correct - expected) ** 2 / (expected * (1 - share))).sum()
    seen.append((metrics["deviance"], deviance, metrics["pearsons_chisqr"], pearson))
    print(f"deviance {seen[-1][0]:.2f}, by definition {deviance:.2f}; chi-squared {seen[-1][2]:.2f}, by definition {pearson:.2f}")
print("bayesfit", meta.version("bayesfit"))
still = all(found <= 0 < right and chi < true / 2 for found, right, chi, true in seen)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
