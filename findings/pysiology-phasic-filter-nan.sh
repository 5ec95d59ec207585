#!/usr/bin/env bash
# pysiology's phasic filter turns a recording of less than four seconds into nan, whatever window it is given.
#
# Expected: docstring of phasicFilter: the median of so many seconds before and after each sample is subtracted (seconds is
#   an argument, four unless said otherwise); a comment in the code says that a window beyond an end is cut to the closest sample.
# Seen: the argument is not used, the window is always 4 s. A window beyond an end is cut to the sample itself: in the
#   first four seconds only what follows counts, in the last only what precedes, and in a recording shorter than 4 s
#   nothing at all: every sample is nan. With seconds=0.25 the same.
# Hurts: sweeps about a pulse, or trials of some seconds: all of analyzeEMG's features that rest on the filtered signal are nan,
#   and its ends are filtered by half a window.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    pysiology==0.0.9.71 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2 peakutils==1.3.5 setuptools==75.8.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pysiology.electromyography import phasicFilter

RATE = 200
rng = np.random.default_rng(1)
seen = {}
for lasting_s in (3, 10):
    emg = 5.0 + rng.normal(0, 1, lasting_s * RATE)
    out = [np.array(phasicFilter(list(emg), RATE, seconds=seconds)) for seconds in (4, 0.25)]
    first = emg[100] - np.median(emg[100 : 100 + 4 * RATE]) if lasting_s == 10 else np.nan
    same, one_sided = np.array_equal(*out, equal_nan=True), np.isclose(out[0][100], first, equal_nan=True)
    seen[lasting_s] = (int(np.isnan(out[0]).sum()), same, bool(one_sided))
    print(f"{lasting_s} s: {seen[lasting_s][0]} of {emg.size} samples are nan; the same with seconds=0.25: {same}")
print("pysiology", meta.version("pysiology"))
still = seen == {3: (600, True, True), 10: (0, True, True)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
