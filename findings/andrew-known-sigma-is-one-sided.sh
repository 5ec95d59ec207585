#!/usr/bin/env bash
# andrew_confidence_intervals: the interval for a known sigma leaves out alpha at each end: "95%" hold the mean in 90 % of samples.
#
# Expected: its summary and what ci_mean prints: a 95% confidence interval for the mean, with alpha = 0.05. With a known sigma it is the mean
#   plus and minus 1.96 standard errors.
# Seen: the quantile of 1 - alpha is taken, 1.645, in place of that of 1 - alpha / 2, which the function takes where sigma is not known. Of
#   10,000 samples 90 % have the true mean in it. Where sigma is not known it is the deviation divided by n, so that five values have
#   an interval a tenth too narrow.
# Hurts: instruments whose error is known from calibration: what is outside is twice as often chance.
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
from andrew_confidence_intervals import ci_mean
from scipy import stats

sample = np.array([4.1, 5.3, 3.8, 4.9, 4.4])
known = [float(one) for one in ci_mean(0.05, sample=sample, true_sigma=0.6, verbose=True)]
right = stats.norm.interval(0.95, sample.mean(), 0.6 / np.sqrt(5))
print(f"sigma known: {known[0]:.3f} to {known[1]:.3f}; by the definition {right[0]:.3f} to {right[1]:.3f}")
unknown = [float(one) for one in ci_mean(0.05, sample=sample)]
student = stats.t.interval(0.95, 4, sample.mean(), sample.std(ddof=1) / np.sqrt(5))
print(f"sigma not known: {unknown[0]:.3f} to {unknown[1]:.3f}; by Student {student[0]:.3f} to {student[1]:.3f}")
samples = np.random.default_rng(1).normal(0, 1, (10_000, 5))
held = np.mean([low < 0 < high for low, high in (ci_mean(0.05, sample=one, true_sigma=1) for one in samples)])
print(f"of 10,000 samples {held:.1%} have the true mean in the 95 % interval")
print("andrew-confidence-intervals", meta.version("andrew-confidence-intervals"))
still = 0.89 < held < 0.92 and abs((known[1] - known[0]) / (right[1] - right[0]) - 1.645 / 1.96) < 0.001
still &= abs((unknown[1] - unknown[0]) / (student[1] - student[0]) - np.sqrt(4 / 5)) < 1e-6
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
