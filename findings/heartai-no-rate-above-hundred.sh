#!/usr/bin/env bash
# heartai finds no two heartbeats within 0.6 s: a heart of 120 a minute has 72, and its classifier takes any recording for 360 Hz.
#
# Expected: its documentation: R-peak detection and heart rate of ECGs, for arrhythmia detection, at the sampling rate given; rates of
#   100 to 180 a minute are tachycardia or exercise.
# Seen: peaks must be 0.6 s apart: up to 100 a minute is right, 110 are 64, 120 are 72 and 150 are 66, with intervals that vary by
#   14 to 20 % although the heart is regular. The analyser does not pass its sampling rate on: at 500 Hz a heart of 75 a minute has a
#   feature "heart rate" of 54, and every regular heart is a "potential arrhythmia" with 90 % confidence or more.
# Hurts: stress tests, children and fever: a fast heart is a slow and irregular one.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 scikit-learn==1.9.1 matplotlib==3.11.2 seaborn==0.13.2 joblib==1.6.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps heartai==0.1.0
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from heartai import ECGAnalyzer
from heartai.core.preprocessing import ECGPreprocessor


def ecg(rate, sampling_hz, seconds=60):
    """A regular heart: R and T waves, a little noise."""
    time = np.arange(seconds * sampling_hz) / sampling_hz
    signal = np.random.default_rng(1).normal(0, 0.01, time.size)
    for beat in np.arange(0.3, seconds, 60 / rate):
        signal += np.exp(-(((time - beat) / 0.01) ** 2)) + 0.15 * np.exp(-(((time - beat - 0.25) / 0.04) ** 2))
    return signal


seen = {}
for rate in (60, 100, 110, 120, 150):
    stage = ECGPreprocessor(360)
    found = stage.calculate_heart_rate(stage.detect_r_peaks(stage.process(ecg(rate, 360))))
    seen[rate] = found["mean_hr"], np.std(found["rr_intervals"]) / np.mean(found["rr_intervals"])
    print(f"{rate} a minute: found {seen[rate][0]:.0f}, intervals vary by {seen[rate][1]:.0%}")
answers = {}
for sampling_hz in (250, 360, 500):
    analyser = ECGAnalyzer(sampling_rate=sampling_hz)
    analyser.raw_data = ecg(75, sampling_hz)
    analyser.preprocess()
    answer = analyser.predict()
    answers[sampling_hz] = float(analyser.detector.extract_features(analyser.processed_data)[8]), answer["status"]
    print(f"75 a minute at {sampling_hz} Hz: feature heart rate {answers[sampling_hz][0]:.0f}, {answer['status']} ({answer['confidence']:.0%})")
print("heartai", meta.version("heartai"))
still = abs(seen[100][0] - 100) < 1 and all(seen[rate][0] < 75 and seen[rate][1] > 0.1 for rate in (110, 120, 150))
still &= abs(answers[500][0] - 54) < 1 and all("arrhythmia" in status for _, status in answers.values())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
