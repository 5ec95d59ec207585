#!/usr/bin/env bash
# noraxy repeats samples a whole number of times to bring channels to one rate: 1500 Hz among 2000 Hz run a third too fast.
#
# Expected: docstring of read_record: all channels are brought to one rate, by default the highest one, each sample held until the
#   next ("forward-fill"); one column of times holds for all channels.
# Seen: the ratio of the rates is rounded. A force at 1500 Hz beside EMG at 2000 Hz is taken as it is: a step at 6 s is at 4.5 s of
#   the common time, and the record, cut to the shortest channel, ends after 7.5 of 10 s. At 300 Hz each sample is held 7
#   times for 6.67: the step is at 6.3 s. At 200 and 400 Hz it is right. Asked for 1000 Hz, a record at 2000 Hz is empty.
# Hurts: movement against EMG: reaction times and delays are those of the rates.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 polars==1.31.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps noraxy==0.1.11
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
from pathlib import Path

import numpy as np
from noraxy import read_record

record = Path("record")
record.mkdir()
(record / "contents").write_text('name: "R1"\n')


def step(rates, asked=None):
    """When a step at 6 s of each channel is found, and the last time."""
    text = ""
    for number, (name, rate) in enumerate(rates.items()):
        (np.arange(10 * rate) >= 6 * rate).astype("<f8").tofile(record / f"analog{number}.r64")
        text += f'channel {{ name: "{name}" units: "N" frequency: {rate} data: PxStream "analog{number}.r64" }}\n' + " " * 900
    (record / "data").write_text(text)
    frame, _ = read_record(record, resample_hz=asked)
    times = frame["time"].to_numpy()
    found = {column: float(times[frame[column].to_numpy() > 0][0]) for column in frame.columns[1:]} if times.size else {}
    return {name.split(" ")[0]: round(at_s, 2) for name, at_s in found.items()}, round(float(times[-1]) if times.size else 0.0, 1)


seen = {}
for rate in (1500, 300, 400):
    seen[rate] = step({"EMG": 2000, "Force": rate})
    print(f"EMG at 2000 Hz, force at {rate} Hz: step at 6 s found at {seen[rate][0]}, the record ends at {seen[rate][1]} s")
empty = step({"EMG": 2000}, asked=1000.0)
print("EMG at 2000 Hz, asked for 1000 Hz:", empty)
print("noraxy", meta.version("noraxy"))
still = (
    seen[1500] == ({"EMG": 6.0, "Force": 4.5}, 7.5)
    and seen[300][0] == {"EMG": 6.0, "Force": 6.3}
    and seen[400] == ({"EMG": 6.0, "Force": 6.0}, 10.0)
    and empty == ({}, 0.0)
)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
