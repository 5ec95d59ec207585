#!/usr/bin/env bash
# MultiDST's SGoF method returns the tests that it should leave out: of 1000 tests without any effect about 50 are significant, not 0.
#
# Expected: docstring of sgof_test: the Sequential Goodness of Fit test. Carvajal-Rodriguez et al., BMC Bioinformatics 10 (2009) 209: one test
#   after the other is taken off the R below alpha until R is what chance gives; those taken off are significant, the excess over chance.
# Seen: those which remain when R is what chance gives are returned. Without any effect these are all below 5 %, uncorrected: 49 of 1000
#   tests, in every set. With 100 effects in 1000 tests about 60 are returned for about 80.
# Hurts: EEG and gene studies that take it for a control of false findings: there is none.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 statsmodels==0.14.4 matplotlib==3.10.8
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps multidst==0.1.11
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import contextlib
import importlib.metadata as meta
import io
import sys

import numpy as np
from scipy.stats import chi2

with contextlib.redirect_stdout(io.StringIO()):
    from multidst.methods import bh_method, sgof_test


def excess(p, alpha=0.05):
    below, expected, taken = int(np.sum(p <= alpha)), len(p) * alpha, 0
    while below > expected and chi2.sf((below - expected) ** 2 / expected, 1) < alpha:
        below, taken = below - 1, taken + 1
    return taken


rng, seen = np.random.default_rng(1), {}
for effects in (0, 100):
    counts = []
    for _ in range(100):
        p = np.concatenate([rng.uniform(size=1000 - effects), rng.uniform(0, 1e-4, effects)])
        counts.append((len(sgof_test(p, 0.05)[1]), excess(p), len(bh_method(p, 0.05)[1])))
    seen[effects] = np.mean(counts, axis=0)
    print(f"{effects} effects in 1000 tests: sgof_test {seen[effects][0]:.1f}, by its definition {seen[effects][1]:.1f}, Benjamini-Hochberg {seen[effects][2]:.1f}")
print("multidst", meta.version("multidst"))
still = 45 < seen[0][0] < 55 and seen[0][1] < 2 and seen[100][0] < 70 < seen[100][1]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
