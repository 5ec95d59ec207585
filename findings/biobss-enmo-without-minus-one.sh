#!/usr/bin/env bash
# BioBSS's "Euclidian norm minus one" does not take one off: a sensor at rest has 0.5 g.
#
# Expected: docstring of calc_activity_index: ENMO is the mean positive deviation of the magnitude of acceleration from 1 g, where
#   magnitudes below 1 g count 0. That of a sensor at rest is about 0.
# Seen: the magnitudes of 1 g and more are averaged as they are. At rest the value is anything between 0 and 1 g, which depends on
#   whether noise, or the last digit of a direction, puts a magnitude above or below 1.
# Hurts: activity is classed by tens of milli-g; rest has 0.5 g here, and 0.3 g up and down at two steps a second 0.6 g.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps biobss==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import importlib.util
import types
from pathlib import Path

root = Path(importlib.util.find_spec("biobss").origin).parent
for name in ("biobss", "biobss.imutools", "biobss.preprocess", "biobss.ecgtools", "biobss.edatools", "biobss.ppgtools"):  # without the plots and detectors that the packages import
    module = types.ModuleType(name)
    module.__path__ = [str(root.joinpath(*name.split(".")[1:]))]
    sys.modules[name] = module
sys.modules["biobss.edatools.eda_filter"] = types.ModuleType("eda_filter")  # needs NeuroKit; ENMO filters nothing

import numpy as np
from biobss.imutools.acc_activityindex import calc_activity_index

rng = np.random.default_rng(1)
time = np.arange(0, 60, 0.01)
still_sensor = np.stack([np.zeros(6000), np.zeros(6000), np.ones(6000)])
noise = still_sensor + rng.normal(0, 0.003, (3, 6000))
walk = noise + np.stack([np.zeros(6000), np.zeros(6000), 0.3 * np.sin(2 * np.pi * 2 * time)])
signals = {"at rest, exactly 1 g": still_sensor, "at rest, 0.999 g": still_sensor * 0.999, "at rest, noise of 3 mg": noise, "0.3 g up and down at 2 Hz": walk}
seen = {}
for name, axes in signals.items():
    value = float(calc_activity_index(*axes, 60, 100, "ENMO")["UFM"])
    right = float(np.maximum(np.linalg.norm(axes, axis=0) - 1, 0).mean())
    seen[name] = value, right
    print(f"{name}: ENMO {value:.4f} g, by the definition {right:.4f} g")
print("biobss", meta.version("biobss"))
values = [value for value, _ in seen.values()]
rights = [right for _, right in seen.values()]
still = values[0] == 1 and values[1] == 0 and values[2] > 0.4 and values[3] > 0.4 and max(rights[:3]) < 0.002 and 0.09 < rights[3] < 0.1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
