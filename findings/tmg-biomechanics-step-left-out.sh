#!/usr/bin/env bash
# tmg-biomechanics ignores the time between samples: at 2 kHz all its times are twice as long and its rates half as large.
#
# Expected: docstring of get_params_of_tmg_signal: dt is the time in ms between subsequent points of the signal, evenly spaced.
#   The delay, contraction, sustain and relaxation times are in ms, so one twitch has the same at any rate.
# Seen: time is the sample's number, and the derivative is made with 1 ms. The same twitch has a contraction time of 17, 34 and
#   67 ms at 1, 2 and 4 kHz, and its rate of displacement is 0.15, 0.08 and 0.04.
# Hurts: tensiomyography, or any twitch, recorded at another rate than 1 kHz: the muscle looks slow.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps tmg-biomechanics==0.0.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from tmg_biomechanics.tmg_params import get_params_of_tmg_signal

seen = {}
for dt in (1.0, 0.5, 0.25):
    times = np.arange(0, 300, dt)  # ms
    twitch = 5 * np.exp(-0.5 * ((times - 60.3) / 20) ** 2)  # mm
    values = get_params_of_tmg_signal(twitch, dt=dt)
    seen[dt] = [float(values[index]) for index in (0, 1, 2, 4, 8)]
    print(f"every {dt} ms: Dm {seen[dt][0]:.2f} mm, Td {seen[dt][1]:.1f}, Tc {seen[dt][2]:.1f}, Tr {seen[dt][3]:.1f} ms", end=", ")
    print(f"largest rate {seen[dt][4]:.3f} mm/ms")
print("tmg-biomechanics", meta.version("tmg-biomechanics"))
still = all(np.allclose(seen[0.25][1:4], 4 * np.array(seen[1.0][1:4]), rtol=0.01) for _ in range(1))
still &= np.isclose(seen[0.25][4], seen[1.0][4] / 4, rtol=0.01)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
