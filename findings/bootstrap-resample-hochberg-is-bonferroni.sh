#!/usr/bin/env bash
# bootstrap-resample's Hochberg correction is Bonferroni's: p of 0.01 to 0.04 become 0.04 to 0.16, for 0.04 each.
#
# Expected: docstring of FWER: Hochberg corrects for the family-wise error (Hochberg 1988): the largest of m p values is compared
#   with alpha, the next with alpha / 2, and so on. It is the default of pTable.
# Seen: the factor is m minus the p value itself instead of minus its rank, and nothing is made monotone. 0.01, 0.02, 0.03 and 0.04
#   become 0.040, 0.080, 0.119 and 0.158; Bonferroni's are 0.04, 0.08, 0.12 and 0.16.
# Hurts: three of four muscles or conditions that are significant by the named method are not.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.0.2 scipy==1.15.3 pandas==2.3.3 joblib==1.5.3 progressbar2==4.5.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps bootstrap-resample==0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from bootstrap_resample import FWER

p = pd.Series([0.01, 0.02, 0.03, 0.04])
package = FWER(p, "Hochberg").round(3).tolist()
steps = [0.0] * 4
best = 1.0
for rank in range(4, 0, -1):
    best = min(best, (4 - rank + 1) * p[rank - 1])
    steps[rank - 1] = round(float(best), 3)
print("p", p.tolist(), "; by the package", package, "; Hochberg", steps, "; Bonferroni", (4 * p).tolist())
print("bootstrap-resample", meta.version("bootstrap-resample"))
still = package == [0.04, 0.08, 0.119, 0.158] and steps == [0.04] * 4
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
