#!/usr/bin/env bash
# adopy's staircase goes up after every trial, whatever the answer, when the answer is given as documented.
#
# Expected: docstring of EnginePsi.get_design, kind "staircase": one step down after an answer of 1, two up after 0; of
#   Engine.update: the response is a dict or a pandas Series, such as {"choice": 1}.
# Seen: the answer is kept as it was given and compared with the number 1. A dict never is that, so that each trial is two
#   steps higher, to the end of the grid, though every stimulus was seen. With a bare number (not documented) it works.
# Hurts: a stimulator's intensity climbs to the largest of the grid, in a procedure that should go down after a response.
#   (adopy needs numpy below 1.24, since it uses np.int.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    adopy==0.4.1 numpy==1.23.5 scipy==1.10.1 pandas==1.5.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from adopy.tasks.psi import EnginePsi, ModelLogistic

designs = {"stimulus": np.arange(20.0, 81.0)}
params = {
    "threshold": np.arange(20.0, 81.0, 2.0),
    "slope": np.array([0.2, 0.5]),
    "guess_rate": np.array([0.01]),
    "lapse_rate": np.array([0.01]),
}
seen = {}
for form in ("dict", "number"):
    np.random.seed(1)
    engine = EnginePsi(ModelLogistic(), designs, params)
    shown = []
    for _ in range(10):
        design = engine.get_design("staircase")
        shown.append(int(design["stimulus"]))
        engine.update(design, {"choice": 1} if form == "dict" else 1)
    seen[form] = np.unique(np.diff(shown[1:])).tolist()
    print(f"answer 1 each time, given as a {form}: stimuli {shown}")
print("adopy", meta.version("adopy"), "numpy", meta.version("numpy"))
still = seen == {"dict": [2], "number": [-1]}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
