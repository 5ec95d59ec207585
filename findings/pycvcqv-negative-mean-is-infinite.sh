#!/usr/bin/env bash
# pycvcqv: a negative mean has an infinite coefficient of variation, as has a small one in another unit, and upside-down intervals.
#
# Expected: docstring of coefficient_of_variation: sd(x) / mean(x), so that of -10 +- 2 is -0.12 as that of 10 +- 2 is 0.12, and the
#   unit does not matter.
# Seen: the check for a mean near zero asks whether it is below 0.000001 and below the SD, which every negative mean is: the
#   coefficient is inf, Kelley's interval 2.28 to -2.28 whatever the values are, the others' inf. Skewed EMG amplitudes with 2.4 in uV
#   have inf in V.
# Hurts: peaks that are negative, such as N20 or N100, logarithms, temperatures, and amplitudes in volts.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pycvcqv==0.7.4
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pycvcqv import coefficient_of_variation

rng = np.random.default_rng(1)
values = rng.normal(10, 2, 20)
skewed = 0.1 * np.abs(np.random.default_rng(3).normal(0, 1, 20)) ** 3  # uV
seen = {}
for name, data in (("10 +- 2", values), ("-10 +- 2", -values), ("-10 +- 0.2", -10 + (values - 10) / 10), ("uV", skewed), ("V", skewed * 1e-6)):
    one = coefficient_of_variation(data, ndigits=6)
    seen[name] = one["cv"], one["lower"], one["upper"]
    print(f"{name}: {one['cv']:.4f}, interval {one['lower']:.4f} to {one['upper']:.4f}; SD / mean {data.std(ddof=1) / data.mean():.4f}")
print("pycvcqv", meta.version("pycvcqv"))
still = np.isfinite(seen["10 +- 2"][0]) and all(np.isinf(seen[name][0]) for name in ("-10 +- 2", "-10 +- 0.2", "V"))
still &= seen["-10 +- 2"][1] > seen["-10 +- 2"][2] and seen["-10 +- 2"] == seen["-10 +- 0.2"] and np.isfinite(seen["uV"][0])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
