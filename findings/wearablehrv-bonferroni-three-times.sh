#!/usr/bin/env bash
# wearablehrv corrects for multiple tests three times: of four regressions none with a p above 0.000125 is significant.
#
# Expected: docstring of bonferroni_correction_regression: "Applies the Bonferroni correction to the p-values". With m tests, p
#   times m is compared with alpha, or p with alpha / m: for four regressions the limit is 0.0125.
# Seen: p is multiplied and then compared with the divided alpha, so the limit is alpha / m². And m is not the number of
#   regressions, but of all their figures (slope, intercept, r, p and error: five for each). The correction of ICCs has the
#   first fault.
# Hurts: devices are validated by it: relations with p = 0.001 in four regressions are "not significant".
# (What it imports for plots, windows and downloads is replaced by stand-ins: nothing of it is used here.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==2.3.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps wearablehrv==0.2.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
from unittest.mock import MagicMock

for name in (
    "avro avro.datafile avro.io hrvanalysis ipywidgets IPython IPython.display matplotlib matplotlib.pyplot matplotlib.dates "
    "matplotlib.transforms pingouin plotly plotly.express plotly.graph_objects pooch seaborn tkinter"
).split():
    sys.modules[name] = MagicMock()
import numpy as np
from wearablehrv import group

rng = np.random.default_rng(3)
conditions = ["sitting", "standing", "walking", "biking"]
truth = {one: rng.normal(50, 15, 25) for one in conditions}
watch = {one: truth[one] + rng.normal(0, spread, 25) for one, spread in zip(conditions, (2, 18, 22, 28))}
data = {
    device: {"rmssd": {one: {f"P{number}": [float(value)] for number, value in enumerate(values[one])} for one in conditions}}
    for device, values in (("watch", watch), ("ecg", truth))
}
found = group.regression_analysis(data, "ecg", conditions, ["watch", "ecg"], ["rmssd"], path=None)
group.bonferroni_correction_regression(found)
still, missed = True, 0
for one in conditions:
    result = found["watch"]["rmssd"][one]
    p, right = result["p_value"], result["p_value"] * len(conditions) < 0.05
    print(f"{one}: p {p:.2g}, times four {min(1, 4 * p):.2g}: significant {right}; wearablehrv: {result['corrected_p_value']:.2g}, {bool(result['is_significant'])}")
    still &= bool(np.isclose(result["corrected_p_value"], min(1, 20 * p)) and result["is_significant"] == (p < 0.05 / 400))
    missed += bool(right and not result["is_significant"])
print("wearablehrv", meta.version("wearablehrv"))
still &= missed > 0
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
