#!/usr/bin/env bash
# pAUC in per cent: the area of 0.74 is 7408, its interval 7407.9 to 7408.1, and specificities are negative.
#
# Expected: ROC has the option percent, as R's pROC (which the code names as its model) has: all is in per cent, so an area of 74.08, an
#   interval of 64.5 to 83.7 and the same best cut-off as without it.
# Seen: both axes are multiplied by 100 and the area by 10000. The interval adds the standard error of the area between 0 and 1 to
#   it. get_coords takes per cent from one: the specificity is -33, and a sensitivity of 80 % is looked for at 0.8.
# Hurts: reports of diagnostic accuracy in per cent; an interval of 0.002 % looks like certainty.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pauc==0.2.2
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from pauc import ROC, ci_auc

rng = np.random.default_rng(0)
ill = np.repeat([0, 1], 50)
score = rng.normal(size=100) + ill
seen = {}
for percent in (False, True):
    roc = ROC(ill, score, percent=percent)
    best = roc.get_coords()
    at_80 = roc.get_coords(x=80 if percent else 0.8, input="sensitivity")
    seen[percent] = float(roc.auc), [float(limit) for limit in ci_auc(roc)], float(best["specificity"]), float(at_80["sensitivity"])
    print(
        f"percent={percent}: area {seen[percent][0]:.4f}, interval {seen[percent][1][0]:.3f} to {seen[percent][1][1]:.3f}, "
        f"specificity at the best cut-off {seen[percent][2]:.2f}, sensitivity where 80 % were asked for {seen[percent][3]:.2f}"
    )
print("pauc", meta.version("pauc"))
still = abs(seen[True][0] - 1e4 * seen[False][0]) < 1e-6 and seen[True][2] < 0 and seen[True][3] < 1
still &= abs(np.diff(seen[True][1])[0] - np.diff(seen[False][1])[0]) < 1e-6
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
