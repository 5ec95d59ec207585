#!/usr/bin/env bash
# scia finds no overlap between equal values: if nothing changes at all, 100 % of the data do not overlap, or 0 % when a fall is expected.
#
# Expected: docstring of pand: the percentage of all non-overlapping data. Parker, Hagan-Burke and Vannest, J. Spec. Educ. 40 (2007): what is
#   left when the fewest values are removed that end all overlap; equal values of both phases overlap, so that one phase must go: 50 %.
# Seen: values are sorted with the phase as second key, after they were shuffled, so that of equal values those of phase A always come first,
#   as if they were smaller. With decreasing=True the order is turned round and they are all overlap. method="minimum" gives 50.
# Hurts: ratings, counts and scores in n-of-1 studies, where most values are equal to others: no change is a perfect effect.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 statsmodels==0.14.4 scikit-learn==1.5.2 matplotlib==3.10.8
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps scia==2.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import contextlib
import importlib.metadata as meta
import io
import sys

import pandas as pd

with contextlib.redirect_stdout(io.StringIO()):
    from scia.pand import pand


def percentage(before, after, method, decreasing=False):
    phases = ["A"] * len(before) + ["B"] * len(after)
    table = pd.DataFrame({"phase": phases, "values": before + after, "mt": range(1, len(phases) + 1)})
    with contextlib.redirect_stdout(io.StringIO()):
        return round(float(pand(table, method=method, decreasing=decreasing, return_values=True)["pand"]), 1)


seen = {}
for name, values in {"all equal": [5] * 6, "same ratings": [4, 5, 5, 5, 5, 6]}.items():
    found = [percentage(values, values, "sort"), percentage(values, values, "sort", decreasing=True)]
    seen[name] = (*found, percentage(values, values, "minimum"))
    print(f"{name} in both phases: {seen[name][0]} % for a rise, {seen[name][1]} % for a fall; method 'minimum' {seen[name][2]} %")
print("scia", meta.version("scia"))
still = seen == {"all equal": (100.0, 0.0, 50.0), "same ratings": (83.3, 16.7, 50.0)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
