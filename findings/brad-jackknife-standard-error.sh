#!/usr/bin/env bash
# brad's standard error of a jackknife is the bootstrap's: with 25 values a fifth of what it should be.
#
# Expected: jackknife returns the statistic without one value at a time, with a method standard_error. The jackknife's standard
#   error is the root of (n - 1) / n times the sum of squares (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, eq.
#   11.5); for the mean it is exactly SD / root of n.
# Seen: it returns the object of the bootstrap, whose standard error is the replications' SD: 0.044 for 0.209 with 25 values, a
#   tenth of it with 100. Its intervals are made with it, too.
# Hurts: an interval for 95 % holds the true value in less than a third of the samples of 25; every difference is significant.
# (numpy 1.26 needs a Python before 3.13.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 scikit-learn==1.5.2 brad==0.2.0a0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import brad
import numpy as np

rng = np.random.default_rng(1)
still = True
for count in (9, 25, 100):
    data = rng.normal(0, 1, count)
    knife = brad.jackknife(data, statistic=np.mean)
    found, right = knife.standard_error(), data.std(ddof=1) / np.sqrt(count)
    by_definition = np.sqrt((count - 1) / count * ((knife.replications - knife.replications.mean()) ** 2).sum())
    interval = knife.confidence_interval(kind="normal")
    print(f"{count} values: standard error {found:.4f} for {right:.4f}; 95 % interval {interval.lower:.3f} to {interval.upper:.3f}", end=", ")
    print(f"right {data.mean() - 1.96 * right:.3f} to {data.mean() + 1.96 * right:.3f}")
    still &= bool(np.isclose(by_definition, right) and np.isclose(found * (count - 1) / np.sqrt(count), right))
print("brad", meta.version("brad"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
