#!/usr/bin/env bash
# abforge spends at each look all alpha that was spent before once more: ten looks at 5 % have 12 % of false findings, one-sided 22 %.
#
# Expected: docstring of SequentialTest: sequential test with alpha spending, alpha is the total type I error, and one may look during the
#   experiment without inflating the false positive rate. With alpha spending a look uses what is added since the last one.
# Seen: each look's boundary is that of the whole alpha spent up to then, as if it were the only look. With ten looks at two equal rates
#   12 % are stopped as significant with Pocock's function, 11 % with the linear one. With two_tailed=False differences in both directions
#   count, which doubles it again.
# Hurts: any study with looks in between, for which the class is made.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 plotly==5.24.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps abforge==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from abforge.sequential import SequentialTest

LOOKS, STEP, STUDIES = 10, 500, 1000
found = {}
for spending in ("pocock", "linear"):
    for two_tailed in (True, False):
        rng = np.random.default_rng(1)
        test = SequentialTest(max_n=LOOKS * STEP, alpha=0.05, spending=spending, two_tailed=two_tailed)
        hits = against = 0
        for _ in range(STUDIES):
            first, second = (np.cumsum(rng.binomial(STEP, 0.3, LOOKS)) for _ in range(2))
            for look in range(LOOKS):
                n = STEP * (look + 1)
                result = test.evaluate(int(first[look]), n, int(second[look]), n, futility_threshold=None)
                if result.decision == "stop_significant":
                    hits += 1
                    against += result.z_score < 0
                    break
        found[spending, two_tailed] = hits / STUDIES, against / STUDIES
        sides = "two" if two_tailed else "one"
        print(f"{spending}, {sides}-sided, no difference: {hits / STUDIES:.1%} significant, {against / STUDIES:.1%} as worse")
print("abforge", meta.version("abforge"))
still = all(0.09 < found[name, True][0] < 0.16 for name in ("pocock", "linear"))
still &= all(found[name, False][0] > 0.15 and found[name, False][1] > 0.06 for name in ("pocock", "linear"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
