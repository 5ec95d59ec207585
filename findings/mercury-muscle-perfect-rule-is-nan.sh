#!/usr/bin/env bash
# mercury-muscle has no accuracy for a rule that makes no mistake: with no false positive or no false negative all is nan.
#
# Expected: RuleEvaluator.evaluate(mode="cm") counts how often a rule on Mercuri scores is right and wrong for a disease; cm_stats
#   gives accuracy, sensitivity, specificity and so on, which are 1 for a rule that is always right.
# Seen: an outcome that does not occur is not counted as 0 but is missing: every figure made with it is nan, the accuracy and the
#   size of the population too. A rule with four of four right has nan throughout, one with a mistake of each kind has figures.
# Hurts: the best rules drop out of a comparison; a table sorted by accuracy begins with the second best.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 pandas==1.5.3 tqdm==4.70.1 tabulate==0.9.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps mercury-muscle==0.1.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from mercury_muscle.rule import RuleEvaluator
from mercury_muscle.score import MercuriTable


def figures(scores, diseases):
    """Statistics of the rule that a soleus above 2 means dystrophy."""
    ids = [f"P{index}" for index in range(len(scores))]
    table = MercuriTable(pd.DataFrame({"id": ids, "disease": diseases, "soleus_L": scores, "soleus_R": scores}))
    rules = RuleEvaluator(table, target="dystrophy")
    rules.add_rule("soleus>2")
    rules.evaluate(side="R", mode="cm")
    return rules.cm_stats().iloc[0]


seen = {}
for case, scores in (("always right", [3, 4, 0, 1]), ("one false positive", [3, 4, 3, 1]), ("one of each kind wrong", [3, 0, 4, 1])):
    one = seen[case] = figures(scores, ["dystrophy", "dystrophy", "other", "other"])
    print(f"{case}: accuracy {one['Accuracy']}, sensitivity {one['Sensitivity']}, specificity {one['Specificity']}, of {one['Population']}")
print("mercury-muscle", meta.version("mercury-muscle"), "pandas", pd.__version__)
perfect, false_positive, wrong = (seen[case] for case in seen)
still = all(np.isnan(float(perfect[name])) for name in ("Accuracy", "Sensitivity", "Specificity", "Population"))
still &= bool(np.isnan(float(false_positive["Accuracy"]))) and wrong["Accuracy"] == 0.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
