#!/usr/bin/env bash
# myonset takes the earlier of two offsets where it should take the later: a burst of 300 ms ends after 205 ms.
#
# Expected: docstring of get_onsets: the onset is the earliest of that of the detected burst and of the integrated profile's
#   minimum; likewise, the offset is the latest of the burst's end and the sample of the profile's maximum.
# Seen: the smaller of both is taken for the offset, too. A strong part from 200 to 400 ms and a weak one, twice the noise, to
#   500 ms: the burst is detected to its end, 489 to 498 ms, the profile's maximum is at 406 ms, and 406 ms is returned.
# Hurts: durations of EMG bursts and of MEPs with a weak tail are too short; silent periods that begin at the offset begin
#   too early.
# (Only these modules are loaded: the package itself opens PyQt5.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.2.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps myonset==1.1.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

import numpy as np

root = meta.distribution("myonset").locate_file("myonset")
for name in ("myonset", "myonset.utils"):
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__path__ = [str(root.joinpath(*name.split(".")[1:]))]
from myonset.emgtools import get_active_sections, get_onsets

RATE = 2000
rng = np.random.default_rng(1)
times = np.arange(-0.5, 1.2, 1 / RATE)
size = np.select([times < 0.2, times < 0.4, times < 0.5], [0, 0.3, 0.02])
still = True
for _ in range(4):
    emg = 0.01 * rng.normal(size=times.size) + size * rng.normal(size=times.size)
    onset, offset = (1000 * times[int(found[0])] for found in get_onsets(emg, times, sf=RATE))
    burst = 1000 * times[get_active_sections(emg, times, sf=RATE)[0]]
    print(f"detected from {burst[0]:.1f} to {burst[1]:.1f} ms; returned {onset:.1f} to {offset:.1f} ms")
    still &= bool(onset <= burst[0] and offset < burst[1] - 50)
print("myonset", meta.version("myonset"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
