#!/usr/bin/env bash
# AutoStatLib drops a missing value from its own group only: in paired tests all persons behind it get each other's values.
#
# Expected: its readme: values that are no numbers (text, None) are dropped silently. A paired test needs both values of a
#   person, so a person with one missing is left out, or the test refused.
# Seen: each list loses its own blanks. If both have one, at different persons, the lengths agree and the test runs: the persons
#   between the two are paired with their neighbours, and there is no warning.
# Hurts: columns pasted from a table with gaps: a difference that the 18 complete persons share, with p = 6e-6, has 0.44.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==2.3.3 statsmodels==0.14.6 scikit-posthocs==0.17.1 seaborn==0.13.2 matplotlib==3.10.8 autostatlib==0.4.8
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import AutoStatLib
import numpy as np
from scipy.stats import ttest_rel

rng = np.random.default_rng(1)
before = rng.normal(50, 15, 20)
after = before + 2 + rng.normal(0, 1, 20)
complete = ttest_rel(np.delete(before, [0, 19]), np.delete(after, [0, 19])).pvalue
shifted = ttest_rel(before[1:], after[:-1]).pvalue
blanks = [["", *before[1:].tolist()], [*after[:-1].tolist(), ""]]
analysis = AutoStatLib.StatisticalAnalysis(blanks, paired=True, verbose=False)
analysis.RunTtestPaired()
result = analysis.GetResult()
found = result["p_value_exact"]
print(f"20 persons, one without the first value and one without the second: p {found:.3g}, of {result['Groups_N']} values")
print(f"of the 18 complete persons {complete:.3g}; of each person with the one before {shifted:.3g}; warnings {len(result['Warnings'])}")
print("autostatlib", meta.version("autostatlib"))
still = bool(np.isclose(found, shifted)) and complete < 0.001 < 0.05 < found and not any("missing" in text for text in result["Warnings"])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
