#!/usr/bin/env bash
# deming's control limits are one standard deviation from the mean: three of ten points of a stable process are out of control.
#
# Expected: its summary: W Edwards Deming quality control charts; the chart's columns are "Upper Control Limit" and "Lower Control Limit".
#   Shewhart's limits, which Deming used, are at three standard deviations: three of a thousand points of a stable process are beyond.
# Seen: both limits are at one standard deviation: 31 % of stable points are beyond them. They cannot be set. The caller's table gets the
#   chart's columns.
# Hurts: any monitoring of a process or of a device's stability: alarms all the time.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 pandas==2.2.3 matplotlib==3.10.8
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps deming==0.1.3
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from deming import control_chart_img_buffer

table = pd.DataFrame({"day": np.arange(2000), "value": np.random.default_rng(1).normal(50, 4, 2000)})
mean, sd = table["value"].mean(), table["value"].std()
control_chart_img_buffer(table, "day", "value")
upper, lower = float(table["Upper Control Limit"].iloc[0]), float(table["Lower Control Limit"].iloc[0])
beyond = float(np.mean((table["value"] > upper) | (table["value"] < lower)))
right = float(np.mean(np.abs(table["value"] - mean) > 3 * sd))
print(f"mean {mean:.2f}, SD {sd:.2f}: limits {lower:.2f} and {upper:.2f}, that is {(upper - mean) / sd:.2f} SD")
print(f"stable points beyond them: {beyond:.1%}; beyond three SD {right:.1%}")
print("columns of the caller's table:", list(table.columns))
print("deming", meta.version("deming"))
still = abs((upper - mean) / sd - 1) < 1e-9 and 0.28 < beyond < 0.35 and right < 0.01
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
