#!/usr/bin/env bash
# BioBSS's mean absolute deviation of a pulse wave is zero, since it is not absolute: the mean of what is left after the mean.
#
# Expected: docstring of ppg_stat_features: mad is the mean absolute deviation of the signal. That of a sine of amplitude 1 is 2 / pi, 0.64.
# Seen: the deviations from the mean are averaged with their signs, which gives zero, or a rounding error of either sign, for every signal.
#   The same feature of acceleration, in acc_stat_features, is right.
# Hurts: tables of features for learning: a column of rounding errors, which depend on the recording's length.
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
for name in ("biobss", "biobss.ppgtools"):  # without the plots and detectors that the package imports
    module = types.ModuleType(name)
    module.__path__ = [str(root.joinpath(*name.split(".")[1:]))]
    sys.modules[name] = module

import numpy as np
from biobss.ppgtools.ppg_statistical import ppg_stat_features

time = np.arange(0, 10, 0.01)
rng = np.random.default_rng(1)
signals = {"sine": np.sin(2 * np.pi * time), "ten times": 10 * np.sin(2 * np.pi * time), "noise": rng.normal(5, 2, 1000), "step": np.repeat([0.0, 1.0], 500)}
seen = {}
for name, signal in signals.items():
    value = float(ppg_stat_features(signal, 100, ["segment"])["ppg_mad"])
    right = float(np.mean(np.abs(signal - signal.mean())))
    seen[name] = value, right
    print(f"{name}: mad {value:.2g}, by the definition {right:.2f}")
print("biobss", meta.version("biobss"))
still = all(abs(value) < 1e-12 and right > 0.4 for value, right in seen.values())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
