#!/usr/bin/env bash
# emg-from-lfp takes its window in ms for seconds: a burst of 10 s is 35 s long, and 25 ms cannot be asked for as 25.
#
# Expected: docstring of compute: window_size is the duration of each window in ms, 25.0 by default.
# Seen: window_size is multiplied by the rate in Hz: the default averages 25 s (its README says so once). Muscle activity from 25 to
#   35 s is seen at 15 and at 45 s too; with 0.025 it is where it was.
# Hurts: sleep scoring by this EMG: arousals and movements of seconds are smeared over half a minute, and short ones vanish.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.1.3 scipy==1.17.1 numba==0.61.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps emg-from-lfp==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from emg_from_lfp import compute

RATE = 2000
rng = np.random.default_rng(0)
muscle = 3 * rng.normal(size=60 * RATE)
muscle[: 25 * RATE] = muscle[35 * RATE :] = 0  # active from 25 to 35 s
lfp = rng.normal(size=(4, 60 * RATE)) + muscle
seen = {}
for window in (25.0, 0.025):
    emg = compute(lfp, RATE, method="per_window", window_size=window)[0]
    seen[window] = {at: round(float(np.mean(emg[at * 20 - 5 : at * 20 + 6])), 1) for at in (5, 15, 20, 30, 40, 45)}
    print(f"window_size={window}: EMG at s {seen[window]}")
print("emg-from-lfp", meta.version("emg-from-lfp"))
still = min(seen[25.0][at] for at in (15, 20, 30, 40, 45)) > 0.3
still = still and seen[0.025][30] > 0.8 and max(abs(seen[0.025][at]) for at in (5, 15, 20, 40, 45)) < 0.2
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
