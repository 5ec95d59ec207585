#!/usr/bin/env bash
# AutoStatLib's repeated measures ANOVA compares the persons, not the conditions.
#
# Expected: its readme: groups are given as a list of lists, one for each condition; the repeated measures ANOVA tests whether
#   the conditions differ, with the persons as subjects.
# Seen: the rows of the table, the conditions, are given as subjects and the columns, the persons, as what is compared. Persons
#   who differ, in three conditions that are all alike, have p = 0; three conditions far apart, with persons alike, have p =
#   0.6. The automatic choice takes this test for three or more paired groups that seem normal.
# Hurts: nearly every set of paired data with three conditions is significant, since persons nearly always differ; an effect of
#   the conditions alone is never found.
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
import pandas as pd
from statsmodels.stats.anova import AnovaRM

rng = np.random.default_rng(1)
noise = rng.normal(0, 1, (3, 12))
persons, conditions = rng.normal(0, 5, 12), np.array([[0.0], [10.0], [20.0]])


def anova(data):
    long = pd.DataFrame(data.T).melt(ignore_index=False, var_name="condition", value_name="value").reset_index(names="person")
    return float(AnovaRM(long, "value", "person", within=["condition"]).fit().anova_table["Pr > F"].iloc[0])


still = True
for case, data in (("persons differ, conditions alike", persons + noise), ("conditions differ, persons alike", conditions + noise)):
    seen = {}
    for test in ("anova_1w_rm", "auto"):
        analysis = AutoStatLib.StatisticalAnalysis(data.tolist(), paired=True, verbose=False)
        analysis.RunAuto() if test == "auto" else analysis.RunManual(test)
        seen[test] = analysis.GetResult()
    found, right, turned = seen["anova_1w_rm"]["p_value_exact"], anova(data), anova(data.T)
    print(f"{case}: p {found:.3g}; of the conditions {right:.3g}, of the persons {turned:.3g}; automatic: {seen['auto']['Test_Name']}")
    still &= bool(np.isclose(found, turned)) and (found < 0.05) != (right < 0.05)
print("autostatlib", meta.version("autostatlib"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
