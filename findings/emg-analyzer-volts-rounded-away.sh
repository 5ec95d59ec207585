#!/usr/bin/env bash
# emg_analyzer writes three decimals: EMG in volts becomes zero, and of 2000 samples a second two have each time.
#
# Expected: docstring of group_by_track's data: the tracks of several .emt files beside each other, with their values; to_emt
#   writes the format of the BTS files, whose header names the unit and the frequency.
# Seen: all values are written with three decimals, whatever the unit: of a track in V, as the header says, with an amplitude of
#   1 mV all samples are 0.001, 0.000 or -0.001, and below 0.5 mV all are zero. Times are in s: at 2000 Hz two samples have the same.
# Hurts: files that are only regrouped (emg_group_tracks) lose the EMG; nothing is said.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 pandas==3.1.1 colorlog==3.1.4 setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation emg-analyzer==0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import math
import sys

from emg_analyzer.emg import Emg


def read(path):
    one = Emg()
    with open(path) as file:
        one.parse(file)
    return one


peaks, rate, number = {"FDI": 0.001, "APB": 0.0004}, 2000, 200
values = {name: [peak * math.sin(index / 7) for index in range(number)] for name, peak in peaks.items()}
with open("one.emt", "w") as file:
    file.write("BTS ASCII format\n\nType:         \tEMG tracks\nMeasure unit: \tV\n\nTracks:       \t2\n")
    file.write(f"Frequency:    \t{rate} Hz\nFrames:       \t{number}\nStart time:   \t0.000\n\n")
    file.write(" Frame\t  Time\tVoltage:FDI\tVoltage:APB\t\n")
    for index in range(number):
        file.write(f"{index}\t{index / rate:.4f}\t{values['FDI'][index]:.7f}\t{values['APB'][index]:.7f}\t\n")
before = read("one.emt")
seen = {}
for grouped in before.group_by_track([]):
    with open(f"{grouped.name}.emt", "w") as file:
        grouped.to_emt(file)
    after = read(f"{grouped.name}.emt").data.data
    levels, times = sorted({float(one) for one in after["one"]}), after["Time"].nunique()
    seen[grouped.name] = levels, times
    peak = before.data.data[grouped.name].max()
    print(f"{grouped.name}: peak {peak:.6f} V, {number} samples; written {levels} at {times} times")
print("emg-analyzer", meta.version("emg-analyzer"))
still = seen["FDI"][0] == [-0.001, 0.0, 0.001] and seen["APB"][0] == [0.0] and seen["FDI"][1] < 0.6 * number
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
