#!/usr/bin/env bash
# multipy's Holm procedure counts one hypothesis too many, and Hochberg's counts p-values instead of looking for the largest.
#
# Expected: docstrings: Holm (1979): the smallest of m p-values is compared with alpha / m, the next with alpha / (m - 1); Hochberg
#   (1988): the largest k whose p is at most alpha / (m - k + 1) is looked for, and it and all smaller ones are rejected.
# Seen: Holm begins with alpha / (m + 1): 0.02 of two is not significant, of 0.01, 0.02 and 0.03 only the first is. Hochberg rejects
#   as many as are below their line, from the smallest on: 0.001, 0.04 and 0.045 are all significant, it says two of them.
# Hurts: a few planned comparisons: Holm is stricter than Bonferroni, than which it should never be.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 statsmodels==0.15.0 setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation multipy==0.16
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from multipy.fwer import bonferroni, hochberg, holm_bonferroni
from statsmodels.stats.multitest import multipletests

seen = []
for values in ([0.02, 0.2], [0.01, 0.02, 0.03], [0.001, 0.04, 0.045]):
    p = np.array(values)
    right = [int(multipletests(p, method=method)[0].sum()) for method in ("bonferroni", "holm", "simes-hochberg")]
    seen.append(([int(one(p).sum()) for one in (bonferroni, holm_bonferroni, hochberg)], right))
    print(f"{values}: Bonferroni, Holm and Hochberg find {seen[-1][0]} significant, statsmodels {right}")
print("multipy", meta.version("multipy"))
still = seen == [([1, 0, 1], [1, 1, 1]), ([1, 1, 3], [1, 3, 3]), ([1, 1, 2], [1, 1, 3])]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
