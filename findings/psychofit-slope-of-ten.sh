#!/usr/bin/env bash
# psychofit limits the slope to ten of whatever unit: a curve 100 ms wide is fitted as 10 ms wide, with lapses to make up for it.
#
# Expected: docstring of mle_fit_psycho: without parmin and parmax reasonable defaults are used; those of the threshold are the
#   smallest and largest stimulus. erf_psycho's slope is in the stimulus's unit: one person has 0.1 in s and 100 in ms.
# Seen: the slope is between 0 and 10 in any unit. Exact proportions of a curve at 20 ms, 100 ms wide, with 2 % of lapses are
#   fitted exactly in s; in ms with 2.4 ms, a width of 9.7 and 11 % of lapses.
# Hurts: stimuli in ms, degrees, cents or per cent: threshold, slope and lapse rate are all wrong, and no warning is given.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps Psychofit==1.0.0.post0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import psychofit

np.random.seed(1)
seen = {}
for unit, factor in (("s", 1), ("ms", 1000)):
    stimuli = np.linspace(-0.2, 0.2, 9) * factor
    true = np.array([0.02 * factor, 0.1 * factor, 0.02])
    data = np.vstack([stimuli, np.full(9, 40.0), psychofit.erf_psycho(true, stimuli)])
    found, likelihood = psychofit.mle_fit_psycho(data, "erf_psycho", nfits=20)
    seen[unit] = found / true
    print(f"in {unit}: bias {found[0]:.4g}, slope {found[1]:.4g}, lapses {found[2]:.3f}", end="; ")
    print(f"true {true[0]:.4g}, {true[1]:.4g}, {true[2]:.3f}; log likelihood {likelihood:.1f}")
print("psychofit", meta.version("psychofit"))
still = np.allclose(seen["s"], 1, atol=0.01) and seen["ms"][1] <= 0.1 and seen["ms"][2] > 4
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
