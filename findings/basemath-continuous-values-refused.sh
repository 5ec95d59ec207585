#!/usr/bin/env bash
# basemath-analysis refuses continuous values as soon as their difference is greater than the number of samples.
#
# Expected: readme, The Continuous Case: give the mean and the variance var_A of a continuous target, such as the revenue per
#   visitor; the other parameters remain the same as in the binary case.
# Seen: the sum's difference is held to be a number of successes: 120 more of the unit among 100 samples raise
#   AnalysisException, "Number of successes cannot be greater than number of samples". In a unit a thousand times larger the same
#   data are taken.
# Hurts: whether a test can be carried out depends on the unit: amplitudes in uV or times in ms cannot be tested.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.15.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps basemath-analysis==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from basemath_analysis.basemath import AnalysisException, BaseMathsTest

seen = {}
for unit, scale in (("ms", 1.0), ("s", 0.001)):
    one = BaseMathsTest(20 * scale, 0.05, 0.05, 0.2, var_A=25 * scale**2, seed="experiment")
    try:
        seen[unit] = one.evaluate_experiment(0, 120 * scale, 0, 100), one.required_samples
    except AnalysisException as error:
        seen[unit] = f"AnalysisException: {error}", one.required_samples
    print(f"mean 20 ms, 100 samples, sums 120 ms apart, in {unit}: {seen[unit][0]} ({seen[unit][1]} samples planned)")
print("basemath-analysis", meta.version("basemath-analysis"))
still = str(seen["ms"][0]).startswith("AnalysisException") and seen["s"][0] in (-1, 0, 1) and seen["ms"][1] == seen["s"][1]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
