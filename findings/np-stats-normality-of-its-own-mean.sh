#!/usr/bin/env bash
# np-stats tests normality by the sample's own mean and SD with the p of a known distribution: nearly everything is normal.
#
# Expected: ks_one_sample: "One-Sample Kolmogorov-Smirnov Test" with the p and the decision at alpha. Lilliefors, JASA 62 (1967): with mean and
#   SD from the sample the usual table must not be used; its test rejects 5 % of normal samples.
# Seen: by default the sample is standardised by its own mean and SD and compared by the table of a known distribution. Of 1000 normal
#   samples none is rejected, of exponential samples with 30 values 11 %, where Lilliefors' test rejects 8 of 10.
# Hurts: who decides by it between a t test and a rank test: everything is "normal".
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 statsmodels==0.14.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps np-stats==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from np_stats import ks_one_sample
from statsmodels.stats.diagnostic import lilliefors

rng, seen = np.random.default_rng(1), {}
for name, draw in {"normal": lambda: rng.normal(100, 15, 30), "exponential": lambda: rng.exponential(20, 30)}.items():
    samples = [draw() for _ in range(1000)]
    seen[name] = np.mean([(ks_one_sample(s, print_result=False)["p_value"] < 0.05, lilliefors(s)[1] < 0.05) for s in samples], axis=0)
    print(f"{name} samples of 30 rejected at 5 %: np-stats {seen[name][0]:.1%}, Lilliefors' test {seen[name][1]:.1%}")
print("np-stats", meta.version("np-stats"))
still = seen["normal"][0] < 0.005 and 0.03 < seen["normal"][1] < 0.07 and seen["exponential"][0] < 0.2 and seen["exponential"][1] > 0.7
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
