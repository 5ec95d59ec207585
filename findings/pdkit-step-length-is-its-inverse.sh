#!/usr/bin/env bash
# pdkit's step length is steps per metre, and its step regularity is that of two samples, whoever walks.
#
# Expected: docstring of GaitProcessor.gait: the average step and stride length in metres, if the distance is given; step and stride
#   regularity along the axis, so the autocorrelation at the duration of a step and of a stride (Moe-Nilssen 2004). A stride is
#   two steps.
# Seen: lengths are the number of steps and strides divided by the distance: 105 steps over 75 m are "1.40 m" each (0.71 m), and a
#   stride is half a step. The autocorrelation is taken at round(1 / duration) samples, so at lag 2 for steps of 0.55 s at any rate:
#   at 100 Hz a regular and an irregular walker have 0.95, where it is 0.99 and 0.27.
# Hurts: gait of persons with Parkinson's disease: small steps are long ones, and irregular steps are not seen at all.
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

RATE, SECONDS, METRES = 100, 60, 75
time = np.arange(SECONDS * RATE) / RATE
seen = {}
for walker, jitter_s in (("regular", 0), ("irregular", 0.12)):
    rng = np.random.default_rng(0)
    steps = 0.5 + np.cumsum(0.55 + jitter_s * rng.normal(size=106))
    steps = steps[steps < SECONDS - 0.5]
    signal = 0.02 * rng.normal(size=time.size) + sum(np.exp(-(((time - step) / 0.08) ** 2)) for step in steps)
    processor = pdkit.GaitProcessor(sampling_frequency=float(RATE), duration=SECONDS, distance=METRES, cutoff_frequency=3.0)
    found = processor.gait(pd.Series(signal.copy()))
    count, step_m, stride_m, step_s, regularity = found[0], found[3], found[4], found[6], found[13]
    centred, lag = signal - signal.mean(), round(step_s * RATE)
    at_a_step = float(np.mean(centred[:-lag] * centred[lag:]) / centred.var())
    seen[walker] = METRES / count, step_m, stride_m, at_a_step, regularity
    print(
        f"{walker}: {count} steps, {METRES / count:.2f} m each, found {step_m:.2f} m, a stride {stride_m:.2f} m; "
        f"autocorrelation at a step {at_a_step:.2f}, step regularity {regularity:.2f}"
    )
print("pdkit", meta.version("pdkit"))
still = all(abs(found - 1 / metres) < 1e-6 and abs(stride - found / 2) < 0.01 for metres, found, stride, _, _ in seen.values())
still &= abs(seen["regular"][4] - seen["irregular"][4]) < 0.02 and seen["regular"][3] - seen["irregular"][3] > 0.3
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
