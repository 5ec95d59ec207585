#!/usr/bin/env bash
# GaugeRnR divides the interaction's variance by the number of parts, not of repetitions: a variance of 4 is 1.1.
#
# Expected: README: gauge repeatability and reproducibility by analysis of variance, for an array of operators, parts and
#   repeated measurements. The variance of operator by part is (MS of operator by part - MS of error) / repetitions.
# Seen: it is divided by the parts. With 3 operators, 10 parts and 3 repetitions a true 4 is 1.1; the gauge's share of the total
#   variance is 0.30 for 0.43 on average. The other three components are right.
# Hurts: reliability of raters and rigs: those who judge persons differently look reproducible.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 statsmodels==0.15.0 plotly==6.4.0 tabulate==0.10.0 docopt-ng==0.9.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps GaugeRnR==0.6.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from GaugeRnR import Component, GaugeRnR, Result

names = {Component.OPERATOR: 1, Component.PART: 9, Component.OPERATOR_BY_PART: 4, Component.MEASUREMENT: 1}
rng = np.random.default_rng(1)
rows, share, right = [], [], []
for _ in range(300):
    data = rng.normal(0, 1, (3, 1, 1)) + rng.normal(0, 3, (1, 10, 1)) + rng.normal(0, 2, (3, 10, 1)) + rng.normal(0, 1, (3, 10, 3))
    result = GaugeRnR(data).calculate()
    variance = [float(np.squeeze(result[Result.Var][one])) for one in names]
    squares = {one: float(np.squeeze(result[Result.MS][one])) for one in names}
    by_part = max((squares[Component.OPERATOR_BY_PART] - squares[Component.MEASUREMENT]) / 3, 0)
    rows.append([*variance, by_part])
    share.append(1 - variance[1] / sum(variance))
    right.append(1 - variance[1] / (sum(variance) - variance[2] + by_part))
means = np.mean(rows, axis=0)
for (component, true), mean in zip(names.items(), means):
    print(f"{component.name}: {mean:.2f}, true {true}")
print(f"operator by part divided by the repetitions: {means[4]:.2f}; share of the gauge {np.mean(share):.2f} for {np.mean(right):.2f}")
print("GaugeRnR", meta.version("GaugeRnR"))
still = np.allclose(np.asarray(rows)[:, 2] * 10 / 3, np.asarray(rows)[:, 4]) and means[2] < 1.5 and 3.5 < means[4] < 4.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
