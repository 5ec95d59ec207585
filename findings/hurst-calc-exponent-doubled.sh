#!/usr/bin/env bash
# hurst-calc's Hurst exponent by the variance is twice the exponent: a random walk has 1.0, and the other method returns two numbers.
#
# Expected: docstring of hurst_exponent: the Hurst exponent as a float, by R/S analysis or by the variance of lagged differences: 0.5 for a
#   random walk by the second, whose standard deviation grows as the root of the lag.
# Seen: the slope of the standard deviation's logarithm is doubled, as would be right for neither it nor the variance: 1.0 for a
#   random walk, 1.7 where it is 0.9. "RS" returns the whole line, slope and intercept, so that a comparison with 0.5 raises.
# Hurts: sway, stride intervals and heart rate: a walk without memory is called fully persistent.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 pandas==3.1.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps hurst-calc==0.1.4
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from hurst_calc import hurst_exponent


def motion(exponent, rng, size=2**14):
    """Fractional Brownian motion of this exponent, by its spectrum."""
    frequency = np.fft.rfftfreq(8 * size)[1:]
    amplitude = frequency ** -(exponent + 0.5) * np.exp(2j * np.pi * rng.random(frequency.size))
    return np.fft.irfft(np.concatenate([[0], amplitude]))[:size]


seen = {}
for exponent in (0.3, 0.5, 0.9):
    table = pd.DataFrame({"sway": motion(exponent, np.random.default_rng(1))})
    seen[exponent] = float(hurst_exponent(table, "sway", method="variance"))
    print(f"exponent {exponent}: by the variance {seen[exponent]:.2f}")
line = hurst_exponent(pd.DataFrame({"sway": np.random.default_rng(1).normal(size=4096)}), "sway", method="RS")
print(f"by R/S a number was promised: {type(line).__name__} of {np.size(line)}")
print("hurst-calc", meta.version("hurst-calc"))
still = all(abs(found - 2 * exponent) < 0.15 for exponent, found in seen.items()) and np.size(line) == 2
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
