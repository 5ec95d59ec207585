#!/usr/bin/env bash
# lasi-spirometry-reference raises TypeError for each age that is not a whole number of years.
#
# Expected: docstring of the module: the table has the values for ages of 45 to 90; ages in between are linearly interpolated. Of
#   predict: age in years, a float, from 45 to 90.
# Seen: the rows next to the age are looked for by comparing whole rows, which are dictionaries: TypeError, '>' or '<' not
#   supported. Whole years are found without it.
# Hurts: ages computed from the date of birth, which are hardly ever whole: no lower limit of normal, or ages cut to years by
#   the caller, which the interpolation is to avoid.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check lasi-spirometry-reference==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from lasi_spirometry_reference import available_age_range, predict

print("ages in the table:", available_age_range())
seen = {}
for age in (45.5, 60, 60.5, 61, 72.25, 89.9):
    for parameter in ("fev1", "fev1fvc"):
        try:
            one = predict("F", age, 155, parameter)
            seen[age, parameter] = f"median {one.median:.2f}, lower limit {one.lln:.2f}"
        except TypeError as error:
            seen[age, parameter] = f"TypeError: {error}"
    print(f"{age} years: FEV1 {seen[age, 'fev1']}; FEV1/FVC {seen[age, 'fev1fvc']}")
print("lasi-spirometry-reference", meta.version("lasi-spirometry-reference"))
still = all(one.startswith("TypeError") == (age % 1 > 0) for (age, _), one in seen.items())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
