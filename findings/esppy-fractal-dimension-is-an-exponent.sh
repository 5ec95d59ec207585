#!/usr/bin/env bash
# esppy's fractal dimension is the exponent of a detrended fluctuation analysis: noise has 0.5 for 2, a random walk 1.5, and a smooth line 2.
#
# Expected: docstring of calc_fractal_dimension: the fractal dimension. A curve has one between 1, if it is smooth, and 2, if it fills the
#   plane (Mandelbrot 1985; Higuchi 1988): white noise 2, a random walk 1.5.
# Seen: it is nolds.dfa, which grows where the dimension falls: white noise has 0.5, a random walk 1.5, a slow sine about 2. What is rougher has
#   the smaller "dimension"; values below 1 are no dimension of a curve. calc_ap_entropy is the sample entropy.
# Hurts: EEG and sway: a loss of complexity is reported as a gain.
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

import nolds
import numpy as np
from esppy.analysis.stats_analysis import calc_fractal_dimension


def higuchi(signal, longest=8):
    steps, lengths = np.arange(1, longest + 1), []
    for step in steps:
        parts = [np.abs(np.diff(signal[start::step])) for start in range(step)]
        lengths.append(np.mean([part.mean() * (len(signal) - 1) / step**2 for part in parts]))
    return -np.polyfit(np.log(steps), np.log(lengths), 1)[0]


rng, seen = np.random.default_rng(1), {}
noise = rng.normal(size=2000)
for name, signal in {"white noise": noise, "random walk": noise.cumsum(), "slow sine": np.sin(np.arange(2000) / 600)}.items():
    seen[name] = (float(calc_fractal_dimension(signal)), float(higuchi(signal)))
    print(f"{name}: fractal dimension {seen[name][0]:.2f}, Higuchi's {seen[name][1]:.2f}, exponent of the fluctuations {nolds.dfa(signal):.2f}")
print("esppy", meta.version("esppy"))
still = seen["white noise"][0] < 0.6 and 1.4 < seen["random walk"][0] < 1.6 and seen["slow sine"][0] > 1.8
still = still and seen["white noise"][1] > 1.9 and seen["slow sine"][1] < 1.1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
