#!/usr/bin/env bash
# andrew_confidence_intervals: a difference of means has the first sample's variance for both: 95 % hold it in 22 %, or in 99 %.
#
# Expected: what ci_mean_dif prints: a 95% confidence interval for the difference of means, for unknown and unequal variances. Each sample
#   has its own variance (Welch).
# Seen: the variance of the first sample is divided by both sizes, the second's is used for nothing but the question whether they are
#   equal. With SDs of 1 and 10 the interval is 0.7 wide for 11, and 15 wide when the samples are exchanged. When only variances and
#   sizes are given it is the same.
# Hurts: patients against healthy people, where variances differ: by the order of arguments all is significant or nothing.
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

import contextlib
import io

import numpy as np
from andrew_confidence_intervals import ci_mean_dif
from scipy.stats import ttest_ind


def interval(first, second):
    with contextlib.redirect_stdout(io.StringIO()):
        return sorted(float(one) for one in ci_mean_dif(0.05, sample_x=first, sample_y=second))


rng = np.random.default_rng(1)
calm, wide = rng.normal(0, 1, 20), rng.normal(0, 10, 20)
widths = {}
for name, pair in (("SD 1 against 10", (calm, wide)), ("SD 10 against 1", (wide, calm))):
    low, high = interval(*pair)
    right = ttest_ind(*pair, equal_var=False).confidence_interval(0.95)
    widths[name] = high - low, float(right.high - right.low)
    print(f"{name}: {low:.2f} to {high:.2f}; Welch {right.low:.2f} to {right.high:.2f}")
held = []
for order in (1, -1):
    inside = [low < 0 < high for low, high in (interval(*(rng.normal(0, 1, 20), rng.normal(0, 10, 20))[::order]) for _ in range(2000))]
    held.append(float(np.mean(inside)))
print(f"of 2000 pairs without a difference {held[0]:.1%} hold zero, with the samples exchanged {held[1]:.1%}")
print("andrew-confidence-intervals", meta.version("andrew-confidence-intervals"))
still = held[0] < 0.35 and held[1] > 0.98 and widths["SD 1 against 10"][0] < 0.25 * widths["SD 1 against 10"][1]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
