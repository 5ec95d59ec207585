#!/usr/bin/env bash
# openhdemg gives motor units the delta F of others when two units do not fire at the same time.
#
# Expected: docstring of compute_deltaf: with average_method "test_unit_average" each unit has the mean over its pairs as test
#   unit; "all" returns the value of each pair. The first is the mean of the second.
# Seen: a pair without overlap is noted as nan among the values, but not among the test units, so that all later pairs are taken for
#   ones before. Of four units in order of recruitment, with two pairs that do not overlap, the third has nan, though it
#   has a value, and the fourth has the third's.
# Hurts: estimates of persistent inward currents of single units, against their recruitment threshold or before and after an
#   intervention; units that are on for a part of the contraction are common. The table looks complete.
# (openhdemg is installed without its windows, which its library does not need.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps openhdemg==0.1.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.2.0 pandas==2.2.3 scipy==1.14.1 matplotlib==3.9.3 seaborn==0.13.2 scikit-learn==1.5.2 \
    openpyxl==3.1.5
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import openhdemg.library as emg
import pandas as pd

RATE = 200
time = np.arange(30 * RATE) / RATE
spans = [(2, 10), (5, 27), (12, 28), (14, 25)]  # in seconds, by recruitment; the first ends before the last two begin
firing = pd.DataFrame(0, index=range(time.size), columns=range(len(spans)))
rates = []
for unit, (begin, end) in enumerate(spans):
    firing.loc[np.round(np.arange(begin, end, 0.1) * RATE).astype(int), unit] = 1
    rates.append(8 + unit + 4 * (1 - np.abs(time - 15) / 15) - 0.1 * (unit + 1) * time)
file = {"NUMBER_OF_MUS": len(spans), "FSAMP": RATE, "BINARY_MUS_FIRING": firing}
pairs = emg.compute_deltaf(file, rates, average_method="all", clean=False)
means = emg.compute_deltaf(file, rates, average_method="test_unit_average", clean=False)["dF"].round(2).tolist()
own = {unit: [] for unit in range(len(spans))}
for (_, test), value in zip(pairs["MU"], pairs["dF"], strict=True):
    own[test].append(value)  # the one that was recruited later
expected = [round(float(pd.Series(values).mean()), 2) if values else float("nan") for values in own.values()]
print("pairs:", {pair: round(float(value), 2) for pair, value in zip(pairs["MU"], pairs["dF"], strict=True)})
print("means of each test unit's pairs:", expected)
print("compute_deltaf:                 ", means)
print("openhdemg", meta.version("openhdemg"))
still = means[1] == expected[1] and np.isnan(means[2]) and means[3] == expected[2] != expected[3]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
