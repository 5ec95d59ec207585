#!/usr/bin/env bash
# actigraph's counts are in g, not in levels of the converter: a minute has at most 1278, where vigorous activity begins at 5725.
#
# Expected: its summary and docstrings: raw acceleration is converted to ActiGraph-like counts, one a second, by Brond et al. (2017). There each of
#   ten samples a second is one of 128 levels up to 2.13 g, and a second's count is the sum of these whole numbers.
# Seen: after the conversion to levels the values are multiplied by the size of a level again, so that sums are in g, 60 times too small. Shaking
#   with 4 g at 2 Hz has 13.3 in a second and 801 in a minute; in levels 796 and 47,800.
# Hurts: cut points for activity, all of which are made for ActiGraph's counts: nobody is ever vigorous, and walking is sedentary.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps actigraph==2018.10.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import actigraph
import numpy as np

LEVEL_G = 2.13 / 127
time = np.arange(60 * 30) / 30
seen = {}
for amplitude_g in (0.1, 1.0, 4.0):
    counts = actigraph.raw_to_counts(amplitude_g * np.sin(2 * np.pi * 2 * time), 30)[10:50]
    levels = counts / LEVEL_G
    seen[amplitude_g] = float(counts.max()), float(np.abs(levels - np.round(levels)).max())
    print(f"{amplitude_g} g at 2 Hz: {counts[:3].round(3)} a second, {60 * counts.mean():.0f} a minute; in levels {60 * levels.mean():.0f}")
most = 60 * float(actigraph.accumulate(np.full(10, 2.13))[0])
print(f"the most a minute can have: {most:.0f}; Freedson's moderate activity begins at 1952, hard at 5725")
print("actigraph", meta.version("actigraph"))
still = most < 1279 and all(top <= 21.3 + 1e-9 and rest < 1e-6 for top, rest in seen.values()) and seen[4.0][0] > 13
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
