#!/usr/bin/env bash
# tituemg's rectification returns nothing, and its envelope cannot be normalised.
#
# Expected: docstring of rec: returns rectified_emg, the rectified signal; of raw_to_env: cvm (array_like) is the maximal voluntary
#   contraction, by which the envelope is normalised; normalizacion, beside it, takes its recording or its maximum.
# Seen: rec computes the signal and returns None. With cvm raw_to_env raises ValueError (the truth value of an array is
#   asked); a number raises too, as it is rectified and filtered as a signal.
# Hurts: the two steps that every analysis of surface EMG has.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check tituemg==0.0.1.4 numpy==2.4.6 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from tituemg import raw_to_env, rec

rng = np.random.default_rng(1)
emg, maximal = rng.normal(size=3000), 4 * rng.normal(size=3000)
rectified = rec(emg)
print("rectified:", rectified)
print(f"envelope without normalisation: mean {np.mean(raw_to_env(emg, 6)):.2f}")
raised = []
for name, cvm in (("the recording", maximal), ("a number", 4.0)):
    try:
        raw_to_env(emg, 6, cvm=cvm)
    except Exception as error:
        raised.append(type(error).__name__)
        print(f"normalised by {name}: {raised[-1]}: {str(error)[:70]}")
print("tituemg", meta.version("tituemg"))
still = rectified is None and len(raised) == 2 and raised[0] == "ValueError"
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
