#!/usr/bin/env bash
# binoculars' Clopper-Pearson interval of none or all is nan: 0 of 20 has no lower limit and 20 of 20 no upper one.
#
# Expected: docstring of binomial_confidence: "A tuple of (lower, upper) confidence interval values". Clopper and Pearson (1934) set the lower
#   limit of 0 hits to 0 and the upper one of n hits to 1; 0 of 20 has 0 to 0.168. These are the cases for which the exact interval is used.
# Seen: the limits are quantiles of a beta distribution whose first or second parameter is then 0, which scipy gives as nan, in silence. A
#   test such as lower <= 0.05 <= upper is false, so that 0 of 20 contradicts 5 %.
# Hurts: rates of detection at the ends of a psychometric function, and of responses without any: they are dropped, or become significant.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps binoculars==0.1.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import math
import sys

from binoculars import binomial_confidence

seen = {}
for hits in (0, 1, 19, 20):
    low, high = binomial_confidence(hits / 20, 20, method="clopper-pearson")
    seen[hits] = (float(low), float(high))
    right = (0.0 if hits == 0 else None, 1.0 if hits == 20 else None)
    note = f"; by definition {right[0] if right[0] is not None else round(low, 3)} to {right[1] if right[1] is not None else round(high, 3)}"
    print(f"{hits} of 20: {low:.3f} to {high:.3f}{note}, holds 0.05: {low <= 0.05 <= high}")
print("binoculars", meta.version("binoculars"))
still = math.isnan(seen[0][0]) and abs(seen[0][1] - (1 - 0.025 ** (1 / 20))) < 1e-4 and math.isnan(seen[20][1])
still = still and all(0 < limit < 1 for hits in (1, 19) for limit in seen[hits])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
