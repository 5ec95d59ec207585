#!/usr/bin/env bash
# ControlCharts does not subtract the mean in Hotelling's T2: every normal point of data around 100 is far beyond the limit.
#
# Expected: docstring of T2: Hotelling's T-squared statistic for anomaly detection, with or without PCA; without scaling "no scaling
#   procedures are used". T2 is the squared distance from the mean of the training set (Hotelling 1947), its limit is exceeded by 0.1 %.
# Seen: with using_pca=False the values themselves are multiplied, not their deviations. Around 0, as in the docstring's example, nothing is
#   seen; around 100 all normal points have about 21,000 where the limit is 14. The Q statistic of the PCA has the same fault.
# Hurts: forces, temperatures, electrode impedances, whatever is not around zero: all is an anomaly.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 matplotlib==3.10.8 \
    scikit-learn==1.5.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps ControlCharts==1.0.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from ControlCharts import T2

rng = np.random.default_rng(1)
seen = {}
for middle in (0, 100):
    data = pd.DataFrame(rng.normal(middle, 1, (400, 2)), columns=["a", "b"])
    chart = T2(using_pca=False)
    chart.fit(data.iloc[:200])
    chart.predict(data.iloc[200:], plot_fig=False)
    values = chart.t2["T2"].to_numpy()
    apart = data.iloc[200:] - data.iloc[:200].mean()
    right = (apart.to_numpy() @ np.linalg.inv(np.cov(data.iloc[:200].T)) * apart.to_numpy()).sum(axis=1)
    seen[middle] = float(np.mean(values > chart.t2_ucl)), float(np.median(values)), float(np.mean(right > chart.t2_ucl))
    print(f"around {middle}: limit {chart.t2_ucl:.1f}, median T2 {seen[middle][1]:.1f}, {seen[middle][0]:.1%} beyond it")
    print(f"    by the definition {seen[middle][2]:.1%} beyond it")
print("ControlCharts", meta.version("ControlCharts"))
still = seen[0][0] < 0.02 and seen[100][0] == 1 and seen[100][1] > 5000 and seen[100][2] < 0.02
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
