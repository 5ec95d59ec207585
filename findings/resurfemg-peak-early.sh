#!/usr/bin/env bash
# resurfemg finds the peak of each burst a twentieth of the burst too early, and divides the height there by that time.
#
# Expected: docstring of time_to_peak: the absolute and relative time to the envelope's peak. Of a symmetric burst the peak
#   is at half its length, with or without smoothing.
# Seen: the burst is smoothed by a moving average that is not centred (its tail is filled with zeros), so that the peak is
#   found half a window, 5 % of the burst, early: 45 % for 50 %, 50 ms in a burst of 1 s. pseudo_slope takes the envelope's
#   height at that early sample: it is not the peak's height.
# Hurts: times to peak (and delays between muscles with bursts of different lengths) are biased by an amount that depends on
#   each burst's length.
# (The packages' own __init__ files, which import MNE and neurokit2, are left out.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps resurfemg==1.1.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

import numpy as np

root = meta.distribution("resurfemg").locate_file("resurfemg")
for name in ("resurfemg", "resurfemg.postprocessing", "resurfemg.helper_functions"):
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__path__ = [str(root.joinpath(*name.split(".")[1:]))]
from resurfemg.postprocessing.features import time_to_peak

seen = {}
for length in (200, 1000, 4000):  # ms at 1 kHz
    times = np.arange(length)
    burst = np.exp(-0.5 * ((times - length // 2) / (length / 8)) ** 2)
    samples, part = time_to_peak(burst, [0], [length])
    seen[length] = (int(burst.argmax()), int(samples[0]), round(float(part[0]), 3))
    print(f"symmetric burst of {length} ms, peak at {seen[length][0]} ms: found at {seen[length][1]} ms, {seen[length][2]} of the burst")
print("resurfemg", meta.version("resurfemg"))
still = all(0.445 <= part <= 0.46 and found < 0.92 * true for true, found, part in seen.values())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
