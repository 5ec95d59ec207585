#!/usr/bin/env bash
# signalytica's coefficient of variation is the variance: in uV it is a million times that in mV, and a mean of 100 does not count.
#
# Expected: its source and list of features: "Coefficient of variation", that is the standard deviation divided by the mean, a number without
#   unit (Pearson 1896).
# Seen: coeff_var returns the variance, the same number as the feature "activity_hjorth_param". In the example of its own documentation both
#   are 0.9296511098623816.
# Hurts: whoever compares the variability of MEPs or EEG features between persons or units: 0.36 for 0.30 in mV, 360000 in uV.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps signalytica==0.1.20
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from signalytica import SignaLytica

mep_mv = 2 + 0.6 * np.tile([-1, 1], 64)
seen = {}
for unit, signal in {"mV": mep_mv, "uV": 1000 * mep_mv, "mV around 100": mep_mv + 98}.items():
    features = SignaLytica().extract_features(signal, ["coeff_var", "activity_hjorth_param"])
    seen[unit] = round(float(features["coeff_var"]), 4)
    print(f"{unit}: {seen[unit]}, Hjorth's activity {features['activity_hjorth_param']:.4f}; SD / mean {signal.std() / signal.mean():.4f}")
print("signalytica", meta.version("signalytica"))
still = seen == {"mV": 0.36, "uV": 360000.0, "mV around 100": 0.36}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
