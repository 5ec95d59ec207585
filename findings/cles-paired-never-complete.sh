#!/usr/bin/env bash
# cles counts one pair too few in a paired design: if all ten persons improve, "90 %" do; if as many worsen, 55 % improve.
#
# Expected: docstring of CLES_2paired: the common language effect size of paired samples, 50 to 100: how many per cent of
#   the differences are above zero. Ten of ten are 100 %, five of ten 50 %. Its own one-sample function gives these for the
#   differences.
# Seen: each difference is compared with n - 1 zeros, and the count is divided by n times n. Ten of ten are 90 %, three of
#   three 67 %; five of ten are 55 %, in the direction that the formula's absolute value then hides.
# Hurts: effects of a treatment within persons are understated, null effects are not 50 %; both the more the smaller the
#   sample.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check cles==0.1.3 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from CLES import CLES_1samp, CLES_2paired

seen = {}
for name, change in (("10 of 10", [1] * 10), ("3 of 3", [1] * 3), ("5 of 10", [1, -1] * 5), ("9 of 10", [1] * 9 + [-1])):
    before = np.arange(len(change), dtype=float)
    after = before + np.array(change)
    seen[name] = round(float(CLES_2paired(before, after)), 1), round(float(CLES_1samp(after - before)), 1)
    print(f"{name} improve: paired {seen[name][0]} %, one sample of the differences {seen[name][1]} %")
print("cles", meta.version("cles"))
still = seen == {"10 of 10": (90.0, 100.0), "3 of 3": (66.7, 100.0), "5 of 10": (55.0, 50.0), "9 of 10": (81.0, 90.0)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
