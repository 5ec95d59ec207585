#!/usr/bin/env bash
# delsys: the mean frequency is that of the spectrum's lines, the same for any EMG, and the mean absolute value is a frequency.
#
# Expected: README and docstrings: EMG.get_features gives temporal and frequency features of windows, in kinds "temp", "freq" and
#   "all", the two together; mav and mnf are the field's names of the mean absolute value and the mean frequency.
# Seen: mnf is the mean of the frequencies, without the power: 501 Hz at 2000 Hz and 1001 Hz at 4000 Hz, for EMG at 30 to 60 Hz as
#   for 150 to 300 Hz. mav is the sum over the window by its seconds, 194 for 0.12 and 335 at twice the rate; in "all" another
#   feature of the same name, the median frequency, replaces it. dsd, a deviation, is negative: it is divided by the seconds minus 1.
# Hurts: fatigue, which is read from the mean frequency, and amplitudes of muscles recorded at different rates.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.2.6 scipy==1.15.3 pandas==2.3.3 matplotlib==3.10.8 \
    scikit-learn==1.9.1 h5py==3.16.0 heartpy==1.2.7 neurokit2==0.3.0 pysampled==1.3.0 delsys==0.5.1
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from delsys import EMG
from scipy.signal import butter, sosfiltfilt

seen = {}
for rate in (2000, 4000):
    for band in ((30, 60), (150, 300)):
        noise = np.random.default_rng(1).normal(size=4 * rate)
        emg = sosfiltfilt(butter(4, band, "bandpass", fs=rate, output="sos"), noise)
        emg *= 0.1 / emg.std()  # mV
        everything, temporal = EMG(emg, rate).get_features(), EMG(emg, rate).get_features(kind="temp")
        power = np.abs(np.fft.rfft(emg)) ** 2
        true = float((np.fft.rfftfreq(emg.size, 1 / rate) * power).sum() / power.sum())
        values = [float(np.median(one)) for one in (everything["mnf"], everything["mav"], temporal["mav"], temporal["dsd"])]
        seen[rate, band[0]] = values
        print(f"EMG at {band[0]} to {band[1]} Hz, rate {rate} Hz: mnf {values[0]:.0f} Hz, by the power {true:.0f} Hz", end="; ")
        print(f"mav {values[1]:.0f} in all, {values[2]:.0f} in temp, by the definition {np.abs(emg).mean():.3f}; dsd {values[3]:.2f}")
print("delsys", meta.version("delsys"))
still = all(seen[rate, 30][0] == seen[rate, 150][0] for rate in (2000, 4000)) and all(one[3] < 0 for one in seen.values())
still &= seen[2000, 30][0] > 400 and 40 < seen[2000, 30][1] < 48 and 1.4 < seen[4000, 30][2] / seen[2000, 30][2] < 2.3
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
