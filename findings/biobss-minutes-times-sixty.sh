#!/usr/bin/env bash
# BioBSS multiplies seconds by 60 to make minutes: the sample after one minute is at 3600 min.
#
# Expected: docstring of create_timestamp_signal: a timestamp array in the resolution "ns", "ms", "s" or "min". In ms the sample after one
#   minute is at 60,000, in s at 60, in min at 1.
# Seen: for "min" the seconds are multiplied by 60 instead of divided: 3600. For the others they are right. The plots of ECG, PPG, EDA,
#   respiration and acceleration make their axes with it.
# Hurts: recordings of hours on an axis in minutes, and any alignment by such times.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps biobss==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import importlib.util
import types
from pathlib import Path

root = Path(importlib.util.find_spec("biobss").origin).parent
for name in ("biobss", "biobss.timetools"):  # without the plots and detectors that the package imports
    module = types.ModuleType(name)
    module.__path__ = [str(root.joinpath(*name.split(".")[1:]))]
    sys.modules[name] = module

from biobss.timetools.timestamp_tools import create_timestamp_signal

seen = {}
for unit, right in (("ns", 60e9), ("ms", 60_000), ("s", 60), ("min", 1)):
    seen[unit] = float(create_timestamp_signal(unit, 601, 0, 10)[600]), right
    print(f"601 samples at 10 Hz, the last in {unit}: {seen[unit][0]:g}, right {right:g}")
print("biobss", meta.version("biobss"))
still = all(abs(a / b - 1) < 1e-9 for unit, (a, b) in seen.items() if unit != "min") and seen["min"][0] == 3600
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
