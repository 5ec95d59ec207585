#!/usr/bin/env bash
# pynapple turns a window that lies after the event into one around it: 18 to 35 ms become -18 to 35 ms.
#
# Expected: docstring of compute_perievent: window is a tuple such as (-2, 1), the two sides may be unequal, and in its example
#   (-0.5, 1.5) is from -0.5 to +1.5 s relative to the event. So (0.018, 0.035) is from 18 to 35 ms after it.
# Seen: the signs are dropped, the first number is always taken as before the event and the second as after it: (18, 35) ms
#   begins at -18 ms, and a baseline of (-100, -10) ms goes on until +10 ms. Nothing is raised or warned.
# Hurts: an MEP's window and a baseline's both hold the stimulus artefact: peak-to-peak amplitudes are those of the artefact.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check pynapple==0.11.4 numpy==2.4.6 pandas==3.1.1 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import importlib.metadata as meta
import sys
import warnings

import numpy as np
import pynapple as nap

RATE = 5000
time = np.arange(12 * RATE) / RATE
emg = np.zeros(time.size)
pulses = np.arange(1, 11)
emg[pulses * RATE + 1] = 5.0  # artefact
emg[pulses * RATE + 110], emg[pulses * RATE + 140] = 0.5, -0.5  # MEP of 1 mV at 22 and 28 ms
seen = {}
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    for window in ((18, 35), (-100, -10)):
        sweeps = nap.compute_perievent(nap.Tsd(t=time, d=emg), nap.Ts(t=pulses.astype(float)), window, time_unit="ms")
        ends = [round(1000 * float(sweeps.t[at]), 1) for at in (0, -1)]
        seen[window] = (*ends, float(np.ptp(sweeps.values, axis=0).mean()))
        print(f"window {window} ms: from {ends[0]} to {ends[1]} ms, peak to peak {seen[window][2]} mV")
told = [str(warning.message) for warning in caught if "window" in str(warning.message)]
print("warnings about windows:", told)
print("pynapple", meta.version("pynapple"))
still = seen == {(18, 35): (-17.8, 35.0, 5.5), (-100, -10): (-100.0, 10.0, 5.0)} and not told
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
