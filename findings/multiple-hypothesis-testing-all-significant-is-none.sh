#!/usr/bin/env bash
# multiple-hypothesis-testing: if all p-values are significant by Benjamini and Hochberg, none is; else it stops at the first.
#
# Expected: docstring of MultiTest.fdr_control: Benjamini and Hochberg's control of the false discovery rate: the p-value up to which
#   all are discoveries, which is the largest one below its line, i / n of the rate.
# Seen: the first p above its line is looked for, and the one before it is returned. If there is none above, it is taken for the
#   first: 0.001, 0.002 and 0.003 give nan, "no discovery". Of 0.03, 0.031, 0.032 and 0.9 three are discoveries, it says nan.
# Hurts: the better the data are the worse: an effect that shows at all electrodes or muscles is reported as nothing.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2 statsmodels==0.15.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps multiple-hypothesis-testing==0.2.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from multitest import MultiTest
from statsmodels.stats.multitest import multipletests

seen = []
for values in ([0.001, 0.002, 0.9], [0.001, 0.002, 0.003], [0.03, 0.031, 0.032, 0.9]):
    p = np.array(values)
    limit = float(MultiTest(p).fdr_control(0.05))
    seen.append((int((p <= limit).sum()), int(multipletests(p, method="fdr_bh")[0].sum())))
    print(f"{values}: up to {limit}, so {seen[-1][0]} discoveries; statsmodels {seen[-1][1]}")
print("multiple-hypothesis-testing", meta.version("multiple-hypothesis-testing"))
still = seen == [(2, 2), (0, 3), (0, 3)]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
