#!/usr/bin/env bash
# liesl measures MEPs in the wrong window at every sampling rate but 1000 Hz: at 5000 Hz from 0.6 to 2 ms after the pulse.
#
# Expected: docstring of liesl.buffers.response.Response: fs is the sampling rate in Hz; pre_in_ms, post_in_ms and
#   ep_window_in_ms (15 to 50 ms unless said otherwise) are milliseconds.
# Seen: milliseconds are turned into samples by 1000 / fs, the inverse of what is needed: at 5000 Hz the MEP is searched for
#   from the 3rd to the 10th sample after the pulse and at 500 Hz from 60 to 200 ms. Nothing is raised or warned.
# Hurts: in a closed loop that takes its peak-to-peak amplitudes from liesl an EMG at 2000 Hz or more yields the amplitude of
#   the stimulus artefact, or of silence, instead of the MEP; threshold hunting follows it.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    liesl==0.3.5.0 pylsl==1.18.6 pyxdf==1.17.5 numpy==2.4.6 setuptools==75.8.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from liesl.buffers.response import Response

PULSE_S = 0.2
seen = {}
for rate in (500, 1000, 2000, 5000):
    time = np.arange(0, 0.6, 1 / rate)
    after_ms = 1000 * (time - PULSE_S)
    artefact = 5000.0 * ((after_ms >= 0) & (after_ms < 2))
    mep = 500 * (np.exp(-(((after_ms - 22) / 1.5) ** 2)) - np.exp(-(((after_ms - 28) / 1.5) ** 2)))
    response = Response((artefact + mep)[:, None], time, PULSE_S, fs=rate)
    first, last = (1000 * (time[at] - PULSE_S) for at in response.ep_window)
    seen[rate] = round(float(response.get_vpp()))
    print(
        f"{rate} Hz: MEP of 1000 uV at 22 and 28 ms, artefact of 5000 uV until 2 ms; "
        f"searched from {first:.1f} to {last:.1f} ms, amplitude {seen[rate]} uV"
    )
print("liesl", meta.version("liesl"))
still = seen == {500: 0, 1000: 1000, 2000: 0, 5000: 5000}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
