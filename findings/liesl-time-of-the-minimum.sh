#!/usr/bin/env bash
# liesl sends the time of an MEP's minimum as the time of its maximum.
#
# Expected: docstring of Response.get_latency: the latencies of the negative peak and of the positive one, in this order. The
#   message of as_json, made to be sent on, has mepmaxtime beside mepmax and mepmin: the time of the maximum.
# Seen: mepmaxtime is the first of the two latencies, that of the minimum. There is no other time in the message. (The rate is
#   1000 Hz, at which liesl's windows are right.)
# Hurts: latencies of MEPs, of which the first peak is the one that is reported: 6 ms late in the example, where the first
#   peak is the positive one, and right if the electrodes are swapped.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    liesl==0.3.5.0 pylsl==1.18.6 pyxdf==1.17.5 numpy==2.4.6 setuptools==75.8.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import json
import sys

import numpy as np
from liesl.buffers.response import Response

time = np.arange(0, 0.4, 0.001)
emg = np.zeros((400, 1))
emg[222], emg[228] = 500, -500  # the pulse is at sample 200
seen = {}
for swapped, sign in ((False, 1), (True, -1)):
    message = json.loads(Response(sign * emg, time, 0.2, fs=1000).as_json())
    seen[swapped] = message["mepmaxtime"]
    print(f"maximum at {28 if swapped else 22} ms, minimum at {22 if swapped else 28} ms:", message)
print("liesl", meta.version("liesl"))
still = seen == {False: 28.0, True: 22.0}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
