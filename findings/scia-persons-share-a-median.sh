#!/usr/bin/env bash
# scia compares all persons of a list with one common median: of two persons who both improve in every session half exceed it.
#
# Expected: docstring of pem: data is "the single-case dataset or list of datasets"; the percentage exceeding the median (Ma, Behav. Modif. 30
#   (2006)) is that of phase B above the person's own median of phase A. nap gives one row for each dataset of a list.
# Seen: a list is put together into one table without numbers for the persons, so that there is one row and one median. A person at 2 before
#   and 5 after and one at 22 and 25 have 50 % (p = 0.61), alone each has 100 % (p = 0.016). pand does the same.
# Hurts: small studies with persons at different levels: the effect is lost; if levels differ in the other way, one is made.
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
    from scia.nap import nap
    from scia.pem import pem


def person(level):
    values = [level + step for step in (1, 2, 3, 2, 1, 2, 5, 6, 5, 6, 5, 6)]
    return pd.DataFrame({"phase": ["A"] * 6 + ["B"] * 6, "values": values, "mt": range(1, 13)})


seen = {}
for name, data in {"first": person(0), "second": person(20), "both": [person(0), person(20)]}.items():
    with contextlib.redirect_stdout(io.StringIO()):
        exceeding, pairs = pem(data), nap(data)
    seen[name] = ([float(value) for value in exceeding["PEM"]], [float(p) for p in exceeding["Binom.p"]], [float(value) for value in pairs["NAP"]])
    print(f"{name}: exceeding the median {seen[name][0]} %, p {seen[name][1]}; non-overlapping pairs {seen[name][2]} %")
print("scia", meta.version("scia"))
still = seen["first"][0] == seen["second"][0] == [100.0] and seen["both"][0] == [50.0] and seen["both"][2] == [100.0, 100.0]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
