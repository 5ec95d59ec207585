#!/usr/bin/env bash
# icc's interval for a confidence of 95 % is one of 90 %.
#
# Expected: docstring of icc: confidence_level, default 0.95, is the "confidence level of the interval"; its sources (McGraw
#   and Wong 1996; Shrout and Fleiss 1979) leave out 2.5 % at each end. For the example of Shrout and Fleiss, ICC(1,1) =
#   0.17, other software gives -0.13 to 0.72.
# Seen: 5 % are left out at each end: -0.10 to 0.64. The interval holds the true value in 90 % of made-up studies. (The
#   p-value, called two-tailed, is that of one tail; and the default call raises ValueError, since the default type is the
#   one that the default model does not have.)
# Hurts: the reliability of repeated MEPs or of two raters looks more certain than it is.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check icc==0.1.1 numpy==2.4.6 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from icc import icc
from scipy.stats import f

example = np.array([[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]])
value, ratio, df1, df2, _, low, high = icc(example, model="oneway", type="agreement")
ends = ratio / f.ppf(0.975, df1, df2), ratio * f.ppf(0.975, df2, df1)
right = [(end - 1) / (end + 3) for end in ends]
print(f"example: {value:.2f}, {low:.2f} to {high:.2f}; with 2.5 % at each end {right[0]:.2f} to {right[1]:.2f}")
try:
    icc(example)
    default = "no error"
except ValueError as error:
    default = f"ValueError: {error}"
print("default call:", default)

rng = np.random.default_rng(1)
held = {}
for model, kind in (("oneway", "agreement"), ("twoway", "agreement"), ("twoway", "consistency")):
    inside = 0
    for _ in range(2000):  # 20 persons, three measures each: the true coefficient is 0.5
        *_, low, high = icc(rng.normal(size=(20, 1)) + rng.normal(size=(20, 3)), model=model, type=kind)
        inside += low <= 0.5 <= high
    held[model, kind] = inside / 2000
    print(f"{model} {kind}: the interval of 95 % holds the true value in {held[model, kind]:.1%}")
print("icc", meta.version("icc"))
still = all(0.87 < share < 0.925 for share in held.values()) and default.startswith("ValueError")
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
