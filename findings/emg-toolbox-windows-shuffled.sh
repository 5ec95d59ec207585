#!/usr/bin/env bash
# emg-toolbox gives each window the features of some other window.
#
# Expected: docstring of extract_all_features: features of windows that slide over the signal; each row begins with the
#   first and last sample of its window, so that its features are of these samples.
# Seen: windows are computed by several threads and their features are collected in the order in which the threads are
#   done (for those that are done already, in that of a set), the first and last samples in that of the signal. In an EMG
#   whose amplitude rises from window to window most rows have the RMS of another; each run has other ones.
# Hurts: fatigue, contraction and rest, anything over time: a feature's course is the true values in a random order, with
#   times beside them that look right.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    emg-toolbox==1.1.0 numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2 seaborn==0.13.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from emg_toolbox.features import extract_all_features

WINDOW = 256
rng = np.random.default_rng(1)
share = []
for windows in (5, 20, 100):
    emg = np.concatenate([rng.normal(0, 1 + one, WINDOW) for one in range(windows)])  # each window twice, thrice ... the first
    rows = extract_all_features(emg, 1000, window_size=WINDOW)
    own = [np.sqrt(np.mean(emg[int(first) : int(last) + 1] ** 2)) for first, last in rows[:, :2]]
    wrong = ~np.isclose(rows[:, 2], own)
    same = np.allclose(np.sort(rows[:, 2]), np.sort(own)) and np.array_equal(rows[:, 0], WINDOW * np.arange(windows))
    share.append(same and wrong.any())
    print(f"{windows} windows: {wrong.sum()} with the RMS of another")
    if windows == 5:
        print("  RMS by emg-toolbox:", np.round(rows[:, 2], 1), "of the samples:", np.round(own, 1))
print("emg-toolbox", meta.version("emg_toolbox"))
still = all(share[1:])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
