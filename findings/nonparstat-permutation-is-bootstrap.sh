#!/usr/bin/env bash
# NonParStat exchanges two methods: the multisample Cucconi test by permutation is a bootstrap, and the other way round.
#
# Expected: docstring of cucconi_multisample_test: method is "bootstrap" or "permutation". Three samples of two persons have 90
#   arrangements, so a permutation's p is a multiple of 1/90; completely separated samples have 6/90 = 0.067.
# Seen: "permutation" gives 0.018, which no permutation of these values can give, "bootstrap" gives 0.067. For two samples the
#   same data have 0.67 by "permutation" in cucconi_test, as they should, and by "bootstrap" in cucconi_multisample_test.
# Hurts: small groups, for which permutations are chosen since they are exact: p is too small here.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 joblib==1.6.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps nonparstat==0.0.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from nonparstat.Cucconi import cucconi_multisample_test, cucconi_test

one, two, three = np.array([1.0, 2.0]), np.array([3.0, 4.0]), np.array([5.0, 6.0])
seen = {}
for method in ("permutation", "bootstrap"):
    np.random.seed(1)
    seen[method] = [
        float(test(*samples, method=method, replications=4000).pvalue)
        for test, samples in (
            (cucconi_multisample_test, [[one, two, three]]),
            (cucconi_multisample_test, [[one, two]]),
            (cucconi_test, [one, two]),
        )
    ]
    print(f"{method}: three samples {seen[method][0]:.3f}; two samples {seen[method][1]:.3f}, by cucconi_test {seen[method][2]:.3f}")
print(f"exact, three samples: {6 / 90:.3f}; two samples, by cucconi_test's permutation: 4/6 = {4 / 6:.3f}")
print("NonParStat", meta.version("NonParStat"))
still = seen["permutation"][0] < 0.03 and 0.055 < seen["bootstrap"][0] < 0.08
still &= abs(seen["bootstrap"][1] - 4 / 6) < 0.03 and abs(seen["permutation"][2] - 4 / 6) < 0.03 and seen["permutation"][1] < 0.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
