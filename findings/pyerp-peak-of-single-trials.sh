#!/usr/bin/env bash
# pyerp's peak amplitude is the highest sample of all single trials: a potential of 5 uV has 35 uV with 20 trials and 42 with 320.
#
# Expected: docstring of peak: "returns peak amplitude with boot strapping", after Musso et al. (2022), for evoked potentials. The peak of an
#   event-related potential is that of the average over trials (Luck 2014, chapter 9); more trials bring it nearer to the true one.
# Seen: the trials drawn are not averaged: the maximum is taken over all of their samples and channels, so that it is the largest noise of
#   all, and grows with the number of trials. Without any potential it is the same.
# Hurts: comparisons of conditions with different numbers of trials, such as targets and non-targets: the rarer one is always smaller.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mne==1.10.1 numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 matplotlib==3.10.8 seaborn==0.13.2 scikit-learn==1.5.2 pyxdf==1.16.8
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pyerp==0.0.4
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import mne
import numpy as np
import pyerp

mne.set_log_level("ERROR")
rng, time, seen = np.random.default_rng(1), np.arange(-0.2, 0.5, 1 / 200), {}
for height, trials in ((5, 20), (5, 80), (5, 320), (0, 320)):
    wave = height * 1e-6 * np.exp(-0.5 * ((time - 0.3) / 0.04) ** 2)
    data = wave + rng.normal(0, 10e-6, (trials, 1, len(time)))
    epochs = mne.EpochsArray(data, mne.create_info(["Cz"], 200, "eeg"), tmin=-0.2)
    seen[height, trials] = float(pyerp.peak(epochs, N=100, seed=1).mean() * 1e6)
    average = float(data.mean(axis=0).max() * 1e6)
    print(f"potential of {height} uV, {trials} trials: peak {seen[height, trials]:.1f} uV, peak of the average {average:.1f} uV")
print("pyerp", meta.version("pyerp"))
still = 30 < seen[5, 20] < seen[5, 80] < seen[5, 320] and seen[0, 320] > 35
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
