#!/usr/bin/env bash
# wrs2_py's effect size is above 1, up to 1.40, and at 20 % trimming it falls as groups move apart: 0.98 at three SD, 0.91 at thirty.
#
# Expected: yuen and t1way, "A Python port of the WRS2 R package", return effsize, Wilcox and Tian's (J. Appl. Stat. 38, 2011) explanatory
#   measure: the root of the share of variance explained by the group, from 0 to 1. WRS2 takes a correlation where the ratio exceeds 1.
# Seen: the branch for a ratio above 1 holds "pass". The variance of two means has the divisor 1, so that without trimming it is up to twice the
#   whole variance. The larger the difference, the smaller the effect, once it is above 1.
# Hurts: reports and meta-analyses of large effects, such as that of the stimulator's intensity on MEPs.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps wrs2-py==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from wrs2_py import t1way, yuen

rng, seen = np.random.default_rng(1), {}
noise = rng.normal(size=(2, 30))
for apart in (1, 3, 10, 30):
    first, second = noise[0], noise[1] + apart
    seen[apart] = [float(yuen(first, second, tr=share)["effsize"]) for share in (0.0, 0.1, 0.2)]
    seen[apart].append(float(t1way([first, second], tr=0.0)["effsize"]))
    print(f"groups {apart} SD apart: effect {seen[apart][0]:.2f} untrimmed, {seen[apart][1]:.2f} at 10 %, {seen[apart][2]:.2f} at 20 %; t1way {seen[apart][3]:.2f}")
print("wrs2-py", meta.version("wrs2-py"))
still = seen[30][0] > 1.35 and seen[3][1] > 1 and seen[3][2] > seen[10][2] > seen[30][2] and seen[10][3] > 1.3
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
