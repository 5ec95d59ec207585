#!/usr/bin/env bash
# foostrap's 95 % interval for the median of an even number of values is the range of all bootstrap samples.
#
# Expected: docstring of foostrap: statistic "quantile", q = 0.5 by default, ci_method "BCa" by default, conf_lvl 0.95: a confidence
#   interval of that level. Its acceleration is made of the statistic without each value in turn (Efron, 1987).
# Seen: without a value the "quantile" is the distance between its two neighbours times a fraction, not the quantile: for the
#   median of an even number it is 0 each time, 0 is divided by 0, and the nan becomes the quantiles 0 and 1. Of 20 values with
#   a median of 95.5 the interval is 86 to 109 for 89 to 103, and wider the more samples are drawn; of 21 it is as it should be.
# Hurts: medians by the default method: one person more or less makes the interval half as wide.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.2.6 scipy==1.15.3 numba==0.61.2 llvmlite==0.44.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps foostrap==1.2.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from foostrap import foostrap
from foostrap.stats_py import jacknife_quantile

still = True
for number in (20, 21, 40, 41):
    values = np.random.default_rng(number).normal(100, 15, number)  # ms
    result = foostrap(values, statistic="quantile", boot_samples=2000, random_state=1, parallel=False)
    low, high = (float(one) for one in result.ci)
    held = float(((result.boot_samples >= low) & (result.boot_samples <= high)).mean())
    right = np.quantile(result.boot_samples, [0.025, 0.975])
    print(f"{number} values: 95 % interval {low:.1f} to {high:.1f}, percentiles {right[0]:.1f} to {right[1]:.1f}", end="; ")
    left_out = jacknife_quantile(np.sort(values), number, 0, 0.5)[1]
    medians = [float(np.median(np.delete(values, index))) for index in range(number)]
    print(f"it holds {held:.1%} of the samples")
    print(f"    median without one value: {left_out.min():.1f} to {left_out.max():.1f} for {min(medians):.1f} to {max(medians):.1f}")
    whole = low == result.boot_samples.min() and high == result.boot_samples.max()
    still &= bool(whole) == (number % 2 == 0) and abs(left_out).max() < 20
print("foostrap", meta.version("foostrap"), "numba", meta.version("numba"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
