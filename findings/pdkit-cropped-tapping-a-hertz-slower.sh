#!/usr/bin/env bash
# pdkit's finger tapping: with the last tap cropped the frequency is one hertz lower, and times in milliseconds are in seconds.
#
# Expected: docstrings of FingerTappingProcessor: frequency is the number of taps divided by the duration, cropping leaves out the last
#   tap; akinesia_times is the mean dwell time in milliseconds; incoordination_score is the variance of the time interval "in
#   msec" between taps, so of ms².
# Seen: cropping subtracts 1 from the quotient instead of from the number: 2.0 Hz become 1.0 Hz, 0.8 Hz are negative. A dwell of
#   150 ms is 0.15. The variance of seconds is multiplied by 1000 instead of by a million: 662 ms² are 0.66.
# Hurts: bradykinesia scores: slow tappers lose most of their frequency, and scores cannot be compared with published ones
#   (kinesia score and incoordination of the BRAIN test).
# (Needs a Python before 3.12, as it needs a numpy before 1.24.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==1.23.5 pandas==1.5.3 scipy==1.10.1 PyWavelets==1.4.1 scikit-learn==1.2.2 matplotlib==3.7.5 tsfresh==0.20.2 \
    future==1.0.0 pandas_validator==0.5.0 soundfile==0.12.1 praat-parselmouth==0.4.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pdkit==1.4.4
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
import pdkit

processor = pdkit.FingerTappingProcessor()
rng = np.random.default_rng(1)
seen = {}
for tapping_hz in (2.0, 0.8):
    down_s = np.arange(0.3, 30, 1 / tapping_hz)
    up_s = down_s + 0.15 + rng.normal(0, 0.03, down_s.size)
    events = pd.DataFrame({"td": np.column_stack([down_s, up_s]).ravel(), "action_type": [0, 1] * down_s.size, "x": 0.0, "y": 0.0})
    events.index = pd.to_datetime(events["td"], unit="s")
    between_ms = 1000 * (down_s[1:] - up_s[:-1])
    seen[tapping_hz] = (
        processor.frequency(events)[0],
        processor.frequency(events, crop="yes")[0],
        processor.akinesia_times(events)[0],
        processor.incoordination_score(events)[0],
        between_ms[1::2].var(),
    )
    whole, cropped, dwell, score, variance = seen[tapping_hz]
    print(
        f"{down_s.size} taps in 30 s: {whole:.2f} Hz, cropped {cropped:.2f} Hz; dwell of 150 ms: {dwell:.3f}; "
        f"variance between taps {variance:.0f} ms²: {score:.2f}"
    )
print("pdkit", meta.version("pdkit"))
still = all(abs(whole - cropped - 1) < 1e-9 and 0.1 < dwell < 0.2 for whole, cropped, dwell, _, _ in seen.values())
still &= all(abs(score - variance / 1000) < 1e-6 for *_, score, variance in seen.values()) and seen[0.8][1] < 0
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
