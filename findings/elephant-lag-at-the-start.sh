#!/usr/bin/env bash
# elephant's cross-correlation has its times from the start of all lags when a number of lags is asked for: 20 ms are -4.92 s.
#
# Expected: docstring of cross_correlation_function: the lag is the tau of <x(t) y(t + tau)>, so that a second signal which is
#   20 ms late has its peak at +20 ms; n_lags=100 at 1 kHz keeps lags from -100 to 100 ms. Its example plots the result
#   over its times.
# Seen: the values are cut to 201, their times are not: they go from -5.0 to -4.8 s in a recording of 10 s, and the peak is at
#   -4.92 s; in one of 20 s at -9.92 s. Without n_lags the peak is at -20 ms, with the sign of the other order.
# Hurts: whoever reads the delay between two muscles, or EMG and force, off the times; it depends on the recording's length, and
#   who leads is the wrong one.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    elephant==1.2.1 neo==0.14.6 quantities==0.16.4 numpy==2.4.6 scipy==1.17.1 tqdm==4.70.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import neo
import numpy as np
import quantities as pq
from elephant.signal_processing import cross_correlation_function

LATE = 20  # samples of 1 ms
rng = np.random.default_rng(1)
seen = []
for lasting_s in (10, 20):
    noise = rng.normal(size=1000 * lasting_s + LATE)
    both = np.column_stack([noise[LATE:], noise[:-LATE]])  # the second has at t + 20 ms what the first has at t
    signal = neo.AnalogSignal(both, units="mV", sampling_rate=1000 * pq.Hz)
    for n_lags in (None, 100):
        result = cross_correlation_function(signal, [0, 1], n_lags=n_lags)
        times = result.times.rescale("s").magnitude
        peak = times[np.argmax(result.magnitude[:, 0])]
        seen.append(round(float(peak), 3))
        print(f"{lasting_s} s, n_lags={n_lags}: {len(times)} lags from {times[0]:.2f} to {times[-1]:.2f} s, peak at {peak:.3f} s")
print("elephant", meta.version("elephant"), "neo", meta.version("neo"))
still = seen == [-0.02, -4.92, -0.02, -9.92]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
