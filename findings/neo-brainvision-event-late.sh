#!/usr/bin/env bash
# neo puts every BrainVision marker one sample late: the first sample is at 1/rate for events, at 0 for the signal.
#
# Expected: positions in a .vmrk file count data points from 1 (BrainVision Core Data Format 1.0; the mandatory
#   "New Segment" marker of the first data point is at position 1), so position p is at (p - 1) / rate.
# Seen: neo divides the position by the rate and does not subtract one, while its analog signal begins at t_start = 0.
#   An event that pybv was asked to write on the sample of a pulse is read one sample after it.
# Hurts: latencies of motor evoked potentials read through neo are one sample short (1 ms at 1 kHz, where
#   onset differences of that size are the result), and differ from those that MNE gives for the same file.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check neo==0.14.6 pybv==0.8.1 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import importlib.metadata as meta
import sys

import neo
import numpy as np
import pybv

rate, pulse = 1000, 400
volts = np.zeros((1, 2000))
volts[0, pulse] = 1e-4  # the artefact of the pulse
events = [{"onset": 0, "description": 1}, {"onset": pulse, "description": 2}]
pybv.write_brainvision(
    data=volts, sfreq=rate, ch_names=["FDI"], fname_base="tms", folder_out=".", events=events, fmt="binary_int16"
)
print(*[line for line in open("tms.vmrk", encoding="utf-8").read().splitlines() if line.startswith("Mk")], sep="\n")
segment = neo.io.BrainVisionIO("tms.vhdr").read_block().segments[0]
signal = segment.analogsignals[0]
peak = float(signal.times.rescale("s")[int(np.argmax(signal.magnitude))])
times = next(event.times.rescale("s").magnitude for event in segment.events if event.name == "Stimulus")
print(f"neo: signal starts at {float(signal.t_start)} s, artefact at {peak:.3f} s, markers at {times} s")
print("neo", meta.version("neo"), "pybv", meta.version("pybv"))
still = np.allclose(times, [1 / rate, (pulse + 1) / rate]) and abs(peak - pulse / rate) < 1e-9
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
