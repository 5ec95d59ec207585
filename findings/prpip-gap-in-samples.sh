#!/usr/bin/env bash
# prpip counts the gap between two blinks in samples, not in ms: at 125 Hz blinks that are 0.7 s apart become one.
#
# Expected: docstring of detect_blinks: sampling_freq is the data's rate and concat_gap_interval the interval within which blinks
#   are joined, 100 ms by default. Blinks of 200 ms that are 300, 700 and 1900 ms apart are five at any rate.
# Seen: 100 samples are the limit. At 1000 and 500 Hz there are five; at 250 Hz, where it is 400 ms, four; at 125 Hz, where it is
#   800 ms, three. At 2000 Hz ZeroDivisionError is raised, since 1000 // rate is divided by.
# Hurts: pupils at the rates of most eye trackers: what was measured between two blinks is replaced with a curve and noise.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 pandas==2.3.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps prpip==1.3.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from prpip import detect_blinks

seen = {}
for rate in (1000, 500, 250, 125, 2000):
    rng = np.random.default_rng(1)
    times = np.arange(12 * rate) / rate
    pupil = 4000 + rng.normal(0, 20, times.size)
    for start in (1.0, 1.5, 3.0, 3.9, 6.0):
        pupil[(times > start - 1e-9) & (times < start + 0.2 - 1e-9)] = 0
    try:
        blinks = detect_blinks(pd.DataFrame({"Pupil Size": pupil}), sampling_freq=rate)
        seen[rate] = len(blinks)
        print(f"{rate} Hz: {len(blinks)} blinks:", [f"{first / rate:.2f} to {last / rate:.2f} s" for first, last in blinks])
    except ZeroDivisionError as error:
        seen[rate] = repr(error)
        print(f"{rate} Hz: {error!r}")
print("prpip", meta.version("prpip"))
still = [seen[rate] for rate in (1000, 500, 250, 125)] == [5, 5, 4, 3] and "ZeroDivision" in str(seen[2000])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
