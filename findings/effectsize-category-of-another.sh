#!/usr/bin/env bash
# effectsize compares a group's categories with the other's by their place: two groups without a common category may differ by 0.
#
# Expected: its documentation: standardised differences by Yang and Dalton (2012), multinomial categories included, so by the
#   proportions of the same category in both groups; a category that nobody of a group has a proportion of 0 there.
# Seen: each group's proportions are of the categories that occur in it, put side by side: with half mild and half moderate
#   against half moderate and half severe the difference is 0.0. If one group has a category more, ValueError.
# Hurts: tables of baseline characteristics: groups that are not alike are shown as balanced, the more so the smaller they are.
# (Needs a Python before 3.12, as it needs a pandas before 2.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.11.4 pandas==1.5.3 statsmodels==0.14.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps effectsize==1.0.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import effectsize
import pandas as pd


def difference(first, second):
    """The package's effect size of two groups' categories, or the error's name."""
    table = pd.DataFrame({"group": [0] * len(first) + [1] * len(second), "severity": first + second})
    try:
        return float(effectsize.compute(data=table, group="group", categorical=["severity"]).iloc[0, 0])
    except ValueError as error:
        return type(error).__name__


cases = {
    "the same categories": (["1 mild"] * 5 + ["2 moderate"] * 15, ["1 mild"] * 15 + ["2 moderate"] * 5),
    "half mild, half moderate against half moderate, half severe": (
        ["1 mild"] * 10 + ["2 moderate"] * 10,
        ["2 moderate"] * 10 + ["3 severe"] * 10,
    ),
    "one category more": (["1 mild"] * 10 + ["2 moderate"] * 10, ["1 mild"] * 5 + ["2 moderate"] * 5 + ["3 severe"] * 10),
}
seen = {what: difference(*groups) for what, groups in cases.items()}
for what, found in seen.items():
    print(f"{what}: {found}")
print("effectsize", meta.version("effectsize"))
still = list(seen.values()) == [1.15, 0.0, "ValueError"]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
