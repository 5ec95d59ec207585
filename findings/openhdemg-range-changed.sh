#!/usr/bin/env bash
# openhdemg changes the list with the limits of discharge rates: the second file of a loop has none left.
#
# Expected: docstring of compute_covisi and basic_mus_properties: idr_range is a list of two limits in pulses per second, and
#   only firings within them are used. The same file with the same limits has the same results.
# Seen: the limits are turned into samples within the caller's list: [4, 50] is [512.0, 40.96] after the call (at 2048 Hz).
#   Taken for rates by the next call, no firing is between them: discharge rates and variations are nan, and the list is
#   [4.0, 50.0] again. Every second file of a loop is nan; nothing is raised.
# Hurts: means over files or participants that leave out nan, as pandas does, are of every second one; with files of two
#   sampling rates the limits do not come back, and all later files have others.
# (openhdemg is installed without its windows, which its library does not need; the file is its own sample.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps openhdemg==0.1.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.2.0 pandas==2.2.3 scipy==1.14.1 matplotlib==3.9.3 seaborn==0.13.2 scikit-learn==1.5.2 \
    openpyxl==3.1.5
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import openhdemg.library as emg

file = emg.emg_from_samplefile()
limits = [4, 50]
seen = []
for call in range(4):
    before = list(limits)
    table = emg.basic_mus_properties(file, start_steady=15000, end_steady=51000, idr_range=limits, mvc=634)
    rate, variation = round(float(table["DR_all"].mean()), 2), round(float(table["COVisi_all"].mean()), 2)
    seen.append((before, rate, variation))
    print(f"call {call + 1} with {before}: mean rate {rate} pps, variation {variation} %; the list is then {limits}")
print("openhdemg", meta.version("openhdemg"))
lists = [before for before, _, _ in seen]
still = lists == [[4, 50], [512.0, 40.96], [4.0, 50.0], [512.0, 40.96]]
still = still and seen[0][1:] == seen[2][1:] and all(value != value for one in (1, 3) for value in seen[one][1:])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
