#!/usr/bin/env bash
# FitPsyche's variance is a slope in one model and a standard deviation in the other: the flatter curve has the smaller "var".
#
# Expected: docstring of PsychometricCurve: parameters of both models: mean, and var, the variance of the distribution, where
#   lower means that the decision flips quicker; both models are cumulative normal distributions. Readme: mean and variance.
# Seen: of exact cumulative normals with SDs of 1, 2 and 4 (variances 1, 4 and 16) the model "logit", which is the default, has
#   a var of 1.70, 0.85 and 0.42: the logistic's slope, which falls. The model "wh" has 1, 2 and 4: the SD.
# Hurts: in the default model the better observer has the larger "variance", so the comparison of two persons or sessions is
#   turned; a cross-validation between the models, as in the readme, mixes the two.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 scikit-learn==1.9.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps FitPsyche==0.1.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from fit_psyche.psychometric_curve import PsychometricCurve
from scipy.stats import norm

levels = np.linspace(0, 20, 41)
seen = {}
for sd in (1.0, 2.0, 4.0):
    share = norm.cdf(levels, 10, sd)
    for model in ("logit", "wh"):
        curve = PsychometricCurve(model=model, guess_rate_lims=(0, 1e-6), lapse_rate_lims=(0, 1e-6)).fit(levels, share)
        seen[model, sd] = float(curve.coefs_["var"])
    logit, wh = seen["logit", sd], seen["wh", sd]
    print(f"SD {sd:g}, variance {sd**2:g}: var is {logit:.2f} (logit) and {wh:.2f} (wh)")
print("default model:", PsychometricCurve().model)
print("FitPsyche", meta.version("FitPsyche"))
falls = seen["logit", 1.0] > seen["logit", 2.0] > seen["logit", 4.0]
still = falls and all(abs(seen["wh", sd] - sd) < 0.01 for sd in (1.0, 2.0, 4.0)) and PsychometricCurve().model == "logit"
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
