#!/usr/bin/env bash
# complexeva's Lyapunov exponent is the logarithm of a distance: it depends on the signal's unit and is largest for a sine.
#
# Expected: docstring of lyapunov_exponent: the largest Lyapunov exponent of a time series. It is a rate at which neighbours move
#   apart, so that the unit of the signal does not matter; ln 2 = 0.69 for the logistic map, 0 for a sine.
# Seen: the distances one step later are not divided by those of the neighbours themselves, and the sign is turned: the mean of
#   -ln(distance). The logistic map has 8.4 in volts, 1.4 in millivolts and -5.5 in microvolts, a sine 7.7 in volts.
# Hurts: comparisons of complexity between channels or persons follow the amplitude and the unit: the smaller signal is the
#   more chaotic one.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 numba==0.68.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps complexeva==0.2.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from complexeva.sequence.lyapunov_exponent import lyapunov_exponent

logistic = [0.3]
while len(logistic) < 2000:
    logistic.append(4 * logistic[-1] * (1 - logistic[-1]))
logistic = np.array(logistic)
print(f"logistic map, by its derivative: {np.mean(np.log(np.abs(4 - 8 * logistic))):.2f}")
signals = {"logistic map": logistic, "sine": np.sin(0.1 * np.arange(2000)), "noise": np.random.default_rng(1).normal(size=2000)}
seen = {}
for name, signal in signals.items():
    for unit, scale in (("V", 1), ("mV", 1e3), ("uV", 1e6)):
        seen[name, unit] = round(float(lyapunov_exponent(signal * scale)), 1)
    print(name, {unit: seen[name, unit] for unit in ("V", "mV", "uV")})
print("complexeva", meta.version("complexeva"))
still = abs(seen["logistic map", "V"] - 8.4) < 0.3 and abs(seen["logistic map", "V"] - seen["logistic map", "mV"] - np.log(1000)) < 0.1
still &= seen["sine", "V"] > 7 and seen["logistic map", "uV"] < -5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
