#!/usr/bin/env bash
# hrv-analysis multiplies the power by Lomb's method by half the heart rate: the same rhythm has half of it at 60 a minute.
#
# Expected: docstring of get_frequency_domain_features: lf and hf are the variance (= power) in the band, by Welch's or Lomb's
#   method. A sine of amplitude A has A^2 / 2 (Task Force of the ESC and NASPE, 1996: ms^2).
# Seen: the unscaled periodogram is integrated over the frequency. A sine of 20 ms at 0.25 Hz, whose variance is 200 ms^2, has 134
#   to 180 by Welch, whose interpolation takes some; by Lomb it has 100 at 60 beats a minute, 150 at 90 and 200 at 120.
# Hurts: the two methods cannot be compared, nor rest with exercise, nor a person with another: who has the faster heart has
#   the greater variability.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==1.26.4 scipy==1.15.3 pandas==2.3.3 matplotlib==3.10.3 astropy==6.1.7 nolds==0.6.1 setuptools==80.9.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps hrv-analysis==1.0.6
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import math
import sys

from hrvanalysis import get_frequency_domain_features

still = True
for rate in (60, 75, 90, 120):
    mean, time, intervals = 60000 / rate, 0.0, []  # ms, s
    while time < 300:
        intervals.append(mean + 20 * math.sin(2 * math.pi * 0.25 * time))
        time += intervals[-1] / 1000
    found = {method: get_frequency_domain_features(intervals, method=method)["hf"] for method in ("welch", "lomb")}
    print(f"{rate} beats a minute, variance 200 ms^2: hf by Welch {found['welch']:.0f}, by Lomb {found['lomb']:.0f}")
    still &= abs(found["lomb"] / (200 * rate / 120) - 1) < 0.1 and 120 < found["welch"] < 220
print("hrv-analysis", meta.version("hrv-analysis"), "astropy", meta.version("astropy"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
