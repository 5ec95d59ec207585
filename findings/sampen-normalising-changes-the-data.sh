#!/usr/bin/env bash
# sampen normalises the caller's list itself, and changes some values twice and others not at all.
#
# Expected: docstring of sampen2: with normalize=True the input is normalised "such that the mean is 0 and the sample variance is 1"; the
#   entropy is then that of the data normalised beforehand, and a series is not changed by its entropy.
# Seen: the list handed over is overwritten: RR intervals with a mean of 800 ms have one of 0 after the call. Each value is
#   looked up by its size in the list that is already changed in part: if one before it now has this size, that one is changed
#   again. [3, 1, 2] becomes [-1.22, 1.22, 0]; of 200 scores from 0 to 8 with a mean of 4 most are wrong.
# Hurts: what is computed after the entropy from the same list (mean, RMSSD); entropies of scores, counts and differences.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps sampen==0.0.20
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from sampen import sampen2
from sampen.normalize_data import normalize_data

three = [round(float(value), 2) for value in normalize_data([3, 1, 2])]
print("[3, 1, 2] normalised:", three)
rng = np.random.default_rng(1)
rr_ms = [int(value) for value in rng.integers(760, 841, 200)]
half = rng.integers(0, 9, 100)
scores = [int(value) for value in np.concatenate([half, 8 - half])]
seen = {}
for what, values in (("RR intervals [ms]", rr_ms), ("scores", scores)):
    mean = float(np.mean(values))
    beforehand = [float(value) for value in (np.array(values) - mean) / np.std(values)]
    right = sampen2(list(beforehand))[2][1]
    found = sampen2(values, normalize=True)[2][1]
    wrong = int(np.sum(np.abs(np.array(values) - beforehand) > 1e-9))
    seen[what] = mean, float(np.mean(values)), wrong, round(right, 3), round(found, 3)
    print(
        f"{what}: mean {mean:.1f}, after the call {seen[what][1]:.1f}; {wrong} of 200 values wrong; "
        f"entropy normalised beforehand {right:.3f}, by normalize=True {found:.3f}"
    )
print("sampen", meta.version("sampen"))
still = three == [-1.22, 1.22, 0] and abs(seen["RR intervals [ms]"][1]) < 1e-6 and seen["RR intervals [ms]"][0] > 790
still &= seen["scores"][0] == 4 and seen["scores"][2] > 50 and abs(seen["scores"][3] - seen["scores"][4]) > 0.05
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
