#!/usr/bin/env bash
# SimStat's bootstrap test against zero has the p-value of one side: one in nine samples of nothing is significant at 5 %.
#
# Expected: docstring of bootstrapTest: whether the data's bootstrap distribution differs from zero, with its p-value; in either direction, so
#   that at 5 % one in twenty samples without an effect is significant.
# Seen: the share of resamples beyond zero is not doubled, and p is 1 wherever it is above 0.05: there are no values between. Of 1000 samples
#   of 30 without an effect 11 % have p below 0.05, about as many as have a two-sided t test's p below 0.1.
# Hurts: differences before and after: twice as many false findings as stated.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 scikit-learn==1.5.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps simstat==0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from scipy.stats import ttest_1samp
from simstat import bootstrapTest

rng = np.random.default_rng(1)
samples = rng.normal(size=(1000, 30))
p = np.array([bootstrapTest(sample, 1000) for sample in samples])
t = ttest_1samp(samples, 0, axis=1).pvalue
print(f"1000 samples of nothing: p < 0.05 in {np.mean(p < 0.05):.1%}; by the t test in {np.mean(t < 0.05):.1%}, p < 0.1 in {np.mean(t < 0.1):.1%}")
print("p between 0.06 and 0.99:", int(np.sum((p > 0.06) & (p < 0.99))))
print("SimStat", meta.version("SimStat"))
still = 0.09 < np.mean(p < 0.05) < 0.14 and np.mean(t < 0.05) < 0.07 and not np.any((p > 0.06) & (p < 0.99))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
