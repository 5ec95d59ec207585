#!/usr/bin/env bash
# hrv's detrended series cannot be cut, and its autoregressive method and a series without times, both documented, raise.
#
# Expected: an RRiDetrended is an RRi: it can be sliced, cropped by time_range and split by time_split. frequency_domain takes
#   method='ar' (Burg), and "when not provided time is created from the cumulative sum of the values".
# Seen: each cut makes a plain RRi, which refuses values below zero, and a detrended series is around zero: ValueError from
#   [:], time_range, time_split, reset_time, describe. 'ar' detrends first and gives the detrended object to spectrum:
#   AttributeError for every series. A list or array without times: TypeError.
# Hurts: a series that was detrended as a whole cannot be analysed by parts; of the two spectral methods one is left.
# (Its import needs a Python before 3.10, or the name that the script puts back; numpy 1.26 one before 3.13.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 matplotlib==3.9.4 spectrum==0.10.0 hrv==0.2.10
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import collections
import collections.abc
import importlib.metadata as meta
import sys

collections.MutableMapping = collections.abc.MutableMapping
import numpy as np
from hrv.classical import frequency_domain
from hrv.detrend import polynomial_detrend
from hrv.rri import RRi

series = RRi(800 + np.random.default_rng(1).normal(0, 20, 1000))
flat = polynomial_detrend(series)
seen = {}
for case, call in (
    ("slice", lambda: flat[:100]),
    ("time_range", lambda: flat.time_range(0, 60)),
    ("time_split", lambda: flat.time_split(60)),
    ("reset_time", lambda: flat.reset_time()),
    ("describe", lambda: flat.describe()),
    ("ar", lambda: frequency_domain(series, method="ar")),
    ("ar of values", lambda: frequency_domain(series.values, time=series.time, method="ar")),
    ("no times", lambda: frequency_domain(series.values)),
    ("with times", lambda: frequency_domain(series.values, time=series.time)),
    ("slice of the series", lambda: series[:100]),
):
    try:
        call()
        seen[case] = "works"
    except Exception as error:
        seen[case] = type(error).__name__
    print(f"{case}: {seen[case]}")
print("hrv", meta.version("hrv"), "spectrum", meta.version("spectrum"))
still = list(seen.values()) == ["ValueError"] * 5 + ["AttributeError"] * 2 + ["TypeError"] + ["works"] * 2
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
