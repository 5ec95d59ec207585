#!/usr/bin/env bash
# ControlCharts' limit of the Q statistic takes powers of the sum for sums of powers: a tripled noise is not seen.
#
# Expected: docstring of T2: T2 and Q statistics by PCA, the limits are for p_value = 0.999 of normal points. Jackson and Mudholkar's
#   limit is made of the sums of the residual eigenvalues, of their squares and of their cubes.
# Seen: the second and third are the square and the cube of the first sum, so that h0 is 1/3 and the limit is that of a single direction, 11
#   times the residual variance. With 20 channels that share two sources the residuals' limit is 5 times that by the definition: of
#   normal points none is beyond it, of points with noise of twice the SD 1 %, by the definition all.
# Hurts: a broken electrode among many channels is not found.
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
from scipy.stats import norm

rng = np.random.default_rng(1)


def record(noise):
    sources = rng.normal(0, 6, (1000, 2)) @ np.kron(np.eye(2), np.ones((1, 10)))
    return pd.DataFrame(sources + rng.normal(0, noise, sources.shape))


train = record(1.0)
chart = T2(explained_variance=0.9)
chart.fit(train)
values = np.sort(np.linalg.eigvalsh(np.cov(train.T)))[::-1][chart.n_components :]
one, two, three = (np.sum(values**power) for power in (1, 2, 3))
h = 1 - 2 * one * three / (3 * two**2)
right = one * (1 + norm.ppf(0.999) * h * np.sqrt(2 * two) / one + two * h * (h - 1) / one**2) ** (1 / h)
shares = {}
for noise in (1.0, 2.0):
    chart.predict(record(noise), plot_fig=False)
    q = chart.q["Q"].to_numpy()
    shares[noise] = float(np.mean(q > chart.q_ucl)), float(np.mean(q > right))
    print(f"noise of SD {noise}: beyond ControlCharts' limit {shares[noise][0]:.1%}, beyond that by the definition {shares[noise][1]:.1%}")
print(f"limits: {chart.q_ucl:.0f}, by the definition {right:.0f}")
print("ControlCharts", meta.version("ControlCharts"))
still = chart.q_ucl > 3.5 * right and shares[1.0][1] < 0.01 and shares[2.0][0] < 0.1 and shares[2.0][1] > 0.9
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
