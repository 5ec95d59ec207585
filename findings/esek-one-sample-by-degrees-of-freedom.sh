#!/usr/bin/env bash
# esek's one-sample t test divides by the root of n - 1, not of n: with 5 persons p is 0.066 for 0.048.
#
# Expected: OneSampleTTest takes the sample's mean, standard deviation and size: t = (mean - population mean) / (SD / root of n),
#   as every textbook has it, and Cohen's d of a t score is t / root of n.
# Seen: both use the root of the degrees of freedom. With 5 persons t is 2.51 for 2.81; the t of 2.81 given as a score has
#   a d of 1.40, the mean and SD it was made of one of 1.26. (It would be right for an SD with divisor n; nothing asks for
#   one.)
# Hurts: small samples, usual in stimulation studies: p values that are too large, d and Hedges' g from published t values
#   that are too large, by 7 % with 8 persons and by 12 % with 5.
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
from esek.calculators.one_sample_mean.one_sample_t import OneSampleTTest
from scipy.stats import ttest_1samp

rng = np.random.default_rng(1)
still = True
for size in (5, 8, 12):
    sample = rng.normal(0.9, 1, size)
    mean, sd = float(sample.mean()), float(sample.std(ddof=1))
    right = ttest_1samp(sample, 0)
    parameters = OneSampleTTest.from_parameters(0, mean, sd, size)
    score = OneSampleTTest.from_score(float(right.statistic), size)
    print(f"{size} persons: t {right.statistic:.3f}, esek {parameters.t_score:.3f}; p {right.pvalue:.4f}, esek {parameters.p_value:.4f};", end=" ")
    print(f"d {mean / sd:.3f}, esek of parameters {parameters.cohens_d.value:.3f}, of the t {score.cohens_d.value:.3f}")
    root = np.sqrt((size - 1) / size)
    still &= bool(np.isclose(parameters.t_score, right.statistic * root) and np.isclose(score.cohens_d.value, mean / sd / root))
    still &= bool(np.isclose(parameters.cohens_d.value, mean / sd))
print("esek", meta.version("esek"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
