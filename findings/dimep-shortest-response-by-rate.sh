#!/usr/bin/env bash
# dimep's shortest MEP after Wassermann is 2 ms at 1 kHz and 10 ms at 5 kHz: the rate decides what is a response.
#
# Expected: docstring of wassermann: the EMG must be above the baseline for at least minimum_duration_in_ms, 2 by default, at any
#   rate.
# Seen: the EMG is first averaged in bins of 1 ms, and their number is then taken for samples at the full rate. An MEP whose EMG is
#   above the baseline for 4 ms counts at 1 and 2 kHz, and is 0 at 5 and 10 kHz; one of 12 ms is 0 at 10 kHz.
# Hurts: most ipsilateral MEPs are that short: with an ordinary EMG amplifier nearly all are said to be absent.
# (Needs a Python before 3.12, as it needs pkg_resources and a scipy before 1.10.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.23.5 scipy==1.9.3 setuptools==65.5.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps dimep==0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from dimep.algo import wassermann


def sweep(response, rate, offset=0.0):
    """0.3 s of EMG in uV, pulse at 0.15 s, noise with an SD of 2 uV."""
    time = np.arange(round(0.3 * rate)) / rate - 0.15
    return time, response(time) + offset + np.random.default_rng(3).normal(0, 2, time.size)


def biphasic(time, onset, duration, peak):
    inside = (time >= onset) & (time < onset + duration)
    return np.where(inside, peak * np.sin(2 * np.pi * (time - onset) / duration), 0.0)


seen = {}
for duration in (0.004, 0.012, 0.020):
    found = []
    for rate in (1000, 2000, 5000, 10000):
        _, emg = sweep(lambda time: biphasic(time, 0.020, duration, 100), rate)
        found.append(round(float(wassermann(emg, round(0.15 * rate), fs=rate))))
    seen[duration] = [size > 0 for size in found]
    print(f"MEP of {duration * 1000:.0f} ms at 1, 2, 5 and 10 kHz: {found} uV above the baseline")
print("dimep", meta.version("dimep"))
still = seen[0.004] == [True, True, False, False] and seen[0.012] == [True, True, True, False] and all(seen[0.020])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
