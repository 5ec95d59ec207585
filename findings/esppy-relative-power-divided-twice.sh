#!/usr/bin/env bash
# esppy divides the relative power by the total power twice: bands add up to 0.046 in uV and to 45,000,000,000 in V, not to 1.
#
# Expected: docstring of calculate_relative_power: "the relative power of the alpha, beta, delta, and theta frequency bands", that is each
#   band's power divided by that of all bands; they add up to 1 and have no unit.
# Seen: each band is divided by the total, and on return once more: the result has the unit of 1 / power. White noise with an SD of 10 uV has
#   bands of 0.005 to 0.026, in volts a trillion times as much. Of two persons the one with the weaker EEG has more of all bands.
# Hurts: any comparison of persons, channels or sessions by relative power: it is turned by the amplitude.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 nolds==0.6.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps esppy==0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from esppy.analysis.stats_analysis import calculate_relative_power, calculate_spectral_power

noise, sums = np.random.default_rng(1).normal(size=250 * 60), {}
for name, scale in {"10 uV": 10, "20 uV": 20, "10 uV, in V": 10e-6}.items():
    freqs, power = calculate_spectral_power(scale * noise, 250)
    bands = calculate_relative_power(freqs, power)
    sums[name] = float(sum(bands.values()))
    print(f"noise of {name}: " + ", ".join(f"{band} {value:.3g}" for band, value in bands.items()) + f"; sum {sums[name]:.3g}")
print("esppy", meta.version("esppy"))
still = 0.03 < sums["10 uV"] < 0.06 and abs(sums["10 uV"] / sums["20 uV"] - 4) < 1e-6 and sums["10 uV, in V"] > 1e10
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
