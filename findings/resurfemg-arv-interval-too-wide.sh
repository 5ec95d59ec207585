#!/usr/bin/env bash
# resurfemg's confidence interval of the average rectified value has the standard error of the EMG that is not rectified.
#
# Expected: docstring of rolling_arv_ci: the confidence interval for each window (of the mean of the rectified EMG), at 1 -
#   alpha. Of independent samples the 95 % interval holds the true mean in 95 % of windows.
# Seen: the standard error is that of the signed samples, whose standard deviation is 1.66 times that of the rectified ones:
#   intervals are 1.66 times too wide and hold the true mean in 99.9 % of windows.
# Hurts: activity above the baseline's interval is found late or not at all; what is called 95 % is about 99.9 %.
# (The packages' own __init__ files, which import MNE and neurokit2, are left out.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps resurfemg==1.1.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

import numpy as np

root = meta.distribution("resurfemg").locate_file("resurfemg")
for name in ("resurfemg", "resurfemg.preprocessing"):
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__path__ = [str(root.joinpath(*name.split(".")[1:]))]
from resurfemg.preprocessing.envelope import rolling_arv_ci

WINDOW, WINDOWS = 201, 4000
emg = np.random.default_rng(1).normal(size=WINDOW * WINDOWS)
lower, upper = rolling_arv_ci(emg, WINDOW)
centres = np.arange(WINDOW // 2, emg.size, WINDOW)
rectified = np.abs(emg).reshape(WINDOWS, WINDOW)
own = 1.972 * rectified.std(axis=1, ddof=1) / np.sqrt(WINDOW)
true = np.sqrt(2 / np.pi)
ratio = float(np.median((upper - lower)[centres] / (2 * own)))
held = float(np.mean((lower[centres] < true) & (true < upper[centres])))
held_own = float(np.mean(np.abs(rectified.mean(axis=1) - true) < own))
print(f"{WINDOWS} windows of {WINDOW} independent samples, true mean {true:.4f}")
print(f"interval by the rectified samples holds it in {100 * held_own:.1f} %, resurfemg's in {100 * held:.2f} %, {ratio:.2f} times as wide")
print("resurfemg", meta.version("resurfemg"))
still = 1.6 < ratio < 1.72 and 0.94 < held_own < 0.96 and held > 0.995
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
