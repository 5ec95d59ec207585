#!/usr/bin/env bash
# abpy-toolkit's Holm and Benjamini-Hochberg values are not made monotone: of three comparisons the two with larger p are significant.
#
# Expected: README: multiple-comparison corrections by Bonferroni, Holm and Benjamini-Hochberg; p_value_adjusted is compared with alpha.
#   Holm's procedure stops at the first p that is too large, so adjusted values never fall as p rises (as in R's p.adjust).
# Seen: each p is multiplied by its own factor only. Of p = 0.021, 0.022 and 0.023 Holm's adjusted values are 0.063, 0.044 and 0.023:
#   the strongest comparison is not significant, the weaker ones are, which Holm would reject none of. Benjamini and Hochberg's of 0.030
#   and 0.035 are 0.060 and 0.035, for 0.035 and 0.035.
# Hurts: studies with several groups: which comparison counts is turned, and Holm's error rate is exceeded.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 pandas==2.2.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps abpy-toolkit==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from abpy.corrections.multiple import apply_corrections

seen = {}
for name, values in (("holm", [0.021, 0.022, 0.023]), ("bh", [0.030, 0.035])):
    results = {f"pair {i + 1}": {"p_value": p} for i, p in enumerate(values)}
    adjusted = [round(one["p_value_adjusted"], 4) for one in apply_corrections(results, name).values()]
    p, rank = np.array(values), np.arange(1, len(values) + 1)
    if name == "holm":
        right = np.maximum.accumulate(p * (len(p) - rank + 1))
    else:
        right = np.minimum.accumulate((p * len(p) / rank)[::-1])[::-1]
    right = [round(float(one), 4) for one in right]
    seen[name] = adjusted, right
    print(f"{name}: p {values}, adjusted {adjusted}; by the definition {right}")
print("abpy-toolkit", meta.version("abpy-toolkit"))
still = seen["holm"] == ([0.063, 0.044, 0.023], [0.063, 0.063, 0.063]) and seen["bh"] == ([0.06, 0.035], [0.035, 0.035])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
