#!/usr/bin/env bash
# cohens-d-effect-size refuses independent groups of different sizes as soon as an axis is given.
#
# Expected: docstring of cohens_d: for two independent samples the pooled deviation is made with n1 and n2, so they may differ;
#   axis is the one along which the effect size is computed, as in NumPy.
# Seen: with an axis the two arrays must be such that they could be subtracted, which only paired samples need: ValueError for
#   10 and 12 persons. Without an axis they work.
# Hurts: an effect size for each electrode, time or muscle of two groups, which is what an axis is for: real groups mostly have
#   not the same size, and cutting the larger one changes the result.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 cohens-d-effect-size==1.2.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from cohens_d import cohens_d

rng = np.random.default_rng(1)
patients, controls = rng.normal(1, 1, (10, 3)), rng.normal(0, 1, (12, 3))
seen = {}
for case, first, second, axis in (
    ("one measure, no axis", patients[:, 0], controls[:, 0], None),
    ("one measure, axis 0", patients[:, 0], controls[:, 0], 0),
    ("three measures, axis 0", patients, controls, 0),
    ("three measures, axis 0, two controls left out", patients, controls[:10], 0),
):
    try:
        seen[case] = cohens_d(first, second, axis=axis)
    except ValueError as error:
        seen[case] = repr(error)
    print(f"{case}: {seen[case]}")
pooled = np.sqrt((9 * patients.var(axis=0, ddof=1) + 11 * controls.var(axis=0, ddof=1)) / 20)
right = (patients.mean(axis=0) - controls.mean(axis=0)) / pooled
print(f"by its own formula {right}")
print("cohens-d-effect-size", meta.version("cohens-d-effect-size"))
values = list(seen.values())
still = np.isclose(values[0], right[0]) and all(isinstance(value, str) for value in values[1:3]) and len(values[3]) == 3
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
