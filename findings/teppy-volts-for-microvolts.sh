#!/usr/bin/env bash
# teppy's amplitudes are a million times too small when one sample of the epochs is above 1 mV.
#
# Expected: docstrings of TEP.get_peaktopeak, get_gmfp and the others: amplitudes are in microvolts. Epochs of MNE are in volts
#   (its documentation on units), whatever is in them.
# Seen: data are taken for volts if the largest sample of all is below 0.001, and for microvolts otherwise. With a
#   pulse artefact of 1.5 mV, or one epoch with a bad electrode, all amplitudes of all channels and epochs stay in volts:
#   16 uV are 0.000016. With an artefact of -1.5 mV they are right. Nothing is raised or warned.
# Hurts: a participant or session with one large positive sample among others without: amplitudes near zero go into
#   the group's mean.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    teppy==0.2.1 mne==1.10.1 numpy==2.2.6 scipy==1.15.3 matplotlib==3.10.5 stockwell==1.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import mne
import numpy as np
from teppy import TEP

mne.set_log_level("error")
RATE = 1000
time = np.arange(-200, 301) / RATE
evoked = sum(
    height * np.exp(-(((time - at) / width) ** 2))
    for height, at, width in ((-3e-6, 0.02, 0.006), (5e-6, 0.045, 0.01), (-6e-6, 0.1, 0.02))
)
info = mne.create_info(["C3", "Cz", "C4"], RATE, "eeg")
noise = np.random.default_rng(1).normal(0, 2e-7, (30, 3, time.size))
seen = {}
for artefact_mv in (0.9, 1.5, -1.5):
    volts = noise + evoked * np.array([1, 2, 0.5])[:, None]
    volts[0, 2, 201] += artefact_mv / 1000  # one sample of one channel in one of 30 epochs
    amplitude = TEP(mne.EpochsArray(volts, info, tmin=-0.2)).get_peaktopeak(pick_ch=["Cz"])[0, 1]
    seen[artefact_mv] = float(amplitude)
    print(f"one sample of {artefact_mv} mV on C4: amplitude of Cz {amplitude:.3g} (uV, says the docstring)")
print("teppy", meta.version("teppy"), "mne", mne.__version__)
still = 15 < seen[0.9] < 17 and seen[-1.5] == seen[0.9] and 15e-6 < seen[1.5] < 17e-6
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
