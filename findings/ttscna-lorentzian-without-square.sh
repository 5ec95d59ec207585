#!/usr/bin/env bash
# ttscna fits a Lorentzian without its square: a mean dwell time of 0.8 ms is stated as 10 ms, longer ones as minus minutes.
#
# Expected: docstrings: a Lorentzian with a DC component and a shoulder frequency f_c is fitted to the difference of two
#   spectra, and gives the mean dwell time. A Lorentzian is S0 / (1 + (f / f_c)^2), and its time is 1 / (2 pi f_c).
# Seen: the model is S0 / (1 + f / f_c), without the square, so that it falls too slowly and its shoulder is anywhere; the
#   time is computed as pi / (2 f_c), ten times that of its definition. Currents made with shoulders of 50, 100 and 200 Hz
#   have dwell times of 3.2, 1.6 and 0.8 ms; stated are -370 s, -1200 s and 10 ms.
# Hurts: noise analysis of channels: nothing it states is near the truth, conductances included.
# (The figure, 60 by 20 inches, is not drawn; text files as those of Axon's Clampfit are written by the script.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    ttscna==0.0.2 numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from scipy.signal import lfilter
from ttscna import ttscna as noise

noise.plot_my_data = lambda *nothing: None
shape = [round(float(noise.loren([1.0, 100.0], f)), 4) for f in (0.0, 100.0, 1000.0)]
print("Lorentzian with a shoulder of 100 Hz at 0, 100 and 1000 Hz: 1, 0.5, 0.0099; ttscna", shape)
RATE = 20_000
times = np.round(np.arange(11 * RATE) / RATE, 6)
wrong = []
for shoulder in (50, 100, 200):
    rng = np.random.default_rng(1)
    keep = np.exp(-2 * np.pi * shoulder / RATE)
    channels = lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.normal(size=times.size))
    current = np.where(times < 5.5, channels - 10, 0) + 0.01 * rng.normal(size=times.size)
    with open("record.txt", "w") as file:
        file.write("header\n" * 9 + "Time (s)\tTrace #1 (pA)\n")
        np.savetxt(file, np.column_stack([times, current]), fmt="%.6f", delimiter="\t")
    noise.ttscna("record.txt", 0.0, 5.5)
    stated = float(pd.read_csv("record_results.csv")["Dwell Time (ms)"][0])
    true = 1000 / (2 * np.pi * shoulder)
    wrong.append(not true / 3 < stated < 3 * true)
    print(f"shoulder {shoulder} Hz, dwell time {true:.2f} ms: stated {stated:.2f} ms")
print("ttscna", meta.version("ttscna"))
still = shape == [1.0, 0.5, 0.0909] and all(wrong)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
