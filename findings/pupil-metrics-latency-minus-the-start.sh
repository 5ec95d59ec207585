#!/usr/bin/env bash
# pupil-metrics subtracts the window's start twice: a pupil that is widest 400 samples after the stimulus has a latency of -100.
#
# Expected: its list of metrics: "Peak latency: time between critical point in task (such as stimulus onset) and peak dilation". With start at
#   sample 500 and the peak at 900 that is 400 samples.
# Seen: the maximum is searched for in arr[:, start:end], whose index counts from start already, and start is subtracted again. Latencies are
#   too small by the start of the window, and negative for each peak earlier than twice that. With start = 0 they are right. A missing sample
#   in the window is the peak, while peak_pupil_size leaves it out.
# Hurts: pupillometry: a latency depends on where the recording begins, and differs between trials with other onsets.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 pandas==2.2.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pupil-metrics==0.0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pupil_metrics import peak_latency, peak_pupil_size

sample = np.arange(2000)
seen = {}
for onset in (0, 500, 800):
    pupil = 3 + 0.5 * np.exp(-0.5 * ((sample - onset - 400) / 120.0) ** 2)
    seen[onset] = int(peak_latency(pupil, onset, onset + 1000)[0])
    print(f"stimulus at sample {onset}, widest at {pupil.argmax()}: latency {seen[onset]} samples, right {pupil.argmax() - onset}")
pupil[900] = np.nan  # a blink at 100 samples
blink = int(peak_latency(pupil, 800, 1800)[0])
print(f"with one missing sample at 900: latency {blink}, peak {peak_pupil_size(pupil, 800, 1800)[0]:.2f} mm")
print("pupil-metrics", meta.version("pupil-metrics"))
still = seen == {0: 400, 500: -100, 800: -400} and blink == 100 - 800
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
