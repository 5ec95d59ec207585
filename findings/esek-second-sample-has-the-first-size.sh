#!/usr/bin/env bash
# esek's robust test of two samples takes the first one's size for both: 60 against 12 have p = 0.002, not 0.08.
#
# Expected: docstring of TwoIndependentRobustTests.from_data: two columns of data, inferential statistics and robust effect
#   sizes; Yuen's test has each sample's own size.
# Seen: the size of the second sample is the length of the first column. A small second group counts as a large one: of pairs of
#   groups without a difference, 60 and 12, a fifth has p < 0.05 (Yuen's test by scipy: 5 %). The result states the wrong
#   size, too.
# Hurts: a patient group of another size than the controls: differences are found where there are none.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 esek==0.1.38
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from esek.calculators.two_independent_mean.two_independent_robust import TwoIndependentRobustTests
from scipy.stats import ttest_ind


def both(first, second):
    result = TwoIndependentRobustTests.from_data([first, second], reps=2)  # the bootstrap is for effect sizes only
    return result, float(ttest_ind(first, second, equal_var=False, trim=0.2).pvalue)


rng = np.random.default_rng(1)
result, right = both(rng.normal(0, 1, 60), rng.normal(0.6, 1, 12))
print(f"60 and 12 persons: p {right:.3f}, esek {result.inferential.p_value:.3f}, which states {result.sample2.size} for the second")
rate = {}
for sizes in ((60, 12), (30, 30)):
    pairs = [both(rng.normal(size=sizes[0]), rng.normal(size=sizes[1])) for _ in range(200)]
    rate[sizes] = [np.mean([p < 0.05 for p in ps]) for ps in zip(*((one.inferential.p_value, p) for one, p in pairs))]
    print(f"no difference, {sizes[0]} and {sizes[1]} persons: p < 0.05 in {rate[sizes][0]:.1%} by esek, {rate[sizes][1]:.1%} by scipy")
print("esek", meta.version("esek"))
still = result.sample2.size == 60 and result.inferential.p_value < right / 10
still &= rate[60, 12][0] > 3 * rate[60, 12][1] and abs(rate[30, 30][0] - rate[30, 30][1]) < 0.02
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
