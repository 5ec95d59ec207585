#!/usr/bin/env bash
# spike2py's calibration subtracts the offset that its formula adds: a torque of 10 Nm is 0 or 20.
#
# Expected: docstring of Waveform.calibrate: "linear formula y=slope*x+offset".
# Seen: with an offset y is slope * x - offset. A transducer that gives 1 V at 10 Nm and 2 V at 15 Nm (slope 5, offset 5) is
#   read as 0 and 5 Nm: all values are wrong by twice the offset, and differences are right, so that traces look fine.
# Hurts: torques, forces and angles, and per cent of the maximum made from them.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check spike2py==0.2.10 numpy==1.26.4 scipy==1.14.1 matplotlib==3.10.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from spike2py.channels import Waveform

volts = np.array([1.0, 2.0, 3.0])
about = {"units": "V", "sampling_frequency": 1000, "path_save_figures": None, "trial_name": "t", "subject_id": "s"}
seen = {}
for slope, offset in ((5.0, 5.0), (5.0, -5.0), (5.0, None)):
    torque = Waveform("torque", {"values": volts.copy(), "times": np.arange(3) / 1000, **about})
    seen[offset] = torque.calibrate(slope, offset).values.tolist()
    print(f"{volts.tolist()} V, slope {slope}, offset {offset}: by the formula {(slope * volts + (offset or 0)).tolist()}, spike2py {seen[offset]}")
print("spike2py", meta.version("spike2py"))
still = seen == {5.0: [0.0, 5.0, 10.0], -5.0: [10.0, 15.0, 20.0], None: [5.0, 10.0, 15.0]}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
