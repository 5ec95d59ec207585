#!/usr/bin/env bash
# pyabf cuts the sampling rate of an ABF file to whole hertz: after ten minutes its times are 60 ms late.
#
# Expected: the ABF format stores the interval between samples in microseconds. Each sample is at its number times the
#   interval, as neo and the acquisition software have it. Docstring of setSweep: sweepX is the time in the sweep or in the file.
# Seen: dataRate is the integer part of 1e6 / interval, and all times come from it: at 150 us (6666.67 Hz; three channels at
#   20 kHz are read out at this rate) the rate is 6666 Hz and a pulse at 590 s is at 590.059 s. Nothing is raised or warned.
# Hurts: pulses and EMG in a recording without sweeps, beside the log of the stimulator or another recording: MEPs
#   come later and later, by more than their latency after four minutes; and rates of pulses and latencies are off by 1e-4.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    pyabf==2.3.8 neo==0.14.6 numpy==2.4.6 matplotlib==3.11.2 pytest==9.2.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import logging
import sys

import neo
import numpy as np
import pyabf
import pyabf.abfWriter

logging.disable(logging.CRITICAL)
seen = {}
for interval_us in (200, 150, 204.8):
    count = int(600e6 / interval_us)
    pulses = (np.array([60.0, 300.0, 590.0]) / interval_us * 1e6).round().astype(int)
    emg = np.zeros((1, count))
    emg[0, pulses] = 1
    pyabf.abfWriter.writeABF1(emg, "emg.abf", 1e6 / interval_us, units="mV")
    file = pyabf.ABF("emg.abf")
    signal = neo.AxonIO("emg.abf").read_block().segments[0].analogsignals[0]
    by_neo = signal.times.rescale("s").magnitude[pulses]
    seen[interval_us] = (file.dataRate, np.round(1000 * (file.sweepX[pulses] - by_neo)).astype(int).tolist())
    print(
        f"{interval_us} us: pyabf has {file.dataRate} Hz, neo {float(signal.sampling_rate):.4f} Hz; "
        f"pulses in neo {by_neo.round(3)} s, in pyabf {file.sweepX[pulses].round(3)} s"
    )
print("pyabf", meta.version("pyabf"), "neo", meta.version("neo"))
still = seen == {200: (5000, [0, 0, 0]), 150: (6666, [6, 30, 59]), 204.8: (4882, [10, 50, 98])}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
