#!/usr/bin/env bash
# andrew_confidence_intervals: the interval for a ratio of variances is upside down: its lower limit is above the upper one.
#
# Expected: what ci_vars_ratio prints: a 95% confidence interval for the ratio of variances, lower limit first. The ratio is divided by the upper
#   quantile of F for the lower limit, and by the lower quantile for the upper one.
# Seen: the quantiles are exchanged: two samples of 20 with a ratio of 0.24 have 0.60 to 0.09, and no ratio lies in it. In each of 2000 pairs of
#   samples the first limit is above the second.
# Hurts: whoever asks whether 1 is above the lower and below the upper limit: equal variances are never found.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation andrew-confidence-intervals==0.0.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from andrew_confidence_intervals import ci_vars_ratio
from scipy.stats import f

rng = np.random.default_rng(1)
first, second = rng.normal(0, 1, 20), rng.normal(0, 1, 20)
low, high = (float(one) for one in ci_vars_ratio(0.05, sample_x=first, sample_y=second, verbose=True))
ratio = float(np.var(first) / np.var(second))
right = ratio / f.ppf(0.975, 19, 19), ratio / f.ppf(0.025, 19, 19)
print(f"ratio {ratio:.2f}: {low:.2f} to {high:.2f}; by the definition {right[0]:.2f} to {right[1]:.2f}")
turned = []
for _ in range(2000):
    low_one, high_one = ci_vars_ratio(0.05, sample_x=rng.normal(size=20), sample_y=rng.normal(size=20))
    turned.append(low_one > high_one)
print(f"of 2000 pairs {np.mean(turned):.0%} have the lower limit above the upper one")
print("andrew-confidence-intervals", meta.version("andrew-confidence-intervals"))
still = all(turned) and abs(low - right[1]) < 1e-9 and abs(high - right[0]) < 1e-9
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
