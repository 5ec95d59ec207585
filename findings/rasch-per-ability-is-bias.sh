#!/usr/bin/env bash
# rasch-per's effect size of item bias compares the groups' raw shares: where one group is abler, every fair item has "large" bias.
#
# Expected: docstring of the DIF module: the "Effect size on the ETS delta scale: delta = -2.35 * ln(odds ratio)". Holland and Thayer (1988), who
#   define it: the common odds ratio of persons with the same total score, so that a difference in ability is no bias.
# Seen: the odds are those of all persons of a group. Two groups whose abilities differ by 1.5, with the same ten Rasch items for both, have
#   2.5 to 3.4 for every item, all of class C, while Lord's chi-squared in the same table flags none. Mantel-Haenszel's delta is below 1.
# Hurts: who drops items of class C, the usual rule: a fair test has none left; groups of equal ability are right.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.2.3 matplotlib==3.10.8 jinja2==3.1.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps rasch-per==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from rasch_per import RaschModel, ResponseData
from rasch_per.dif import DIFAnalysis


def mantel_haenszel(answers, focal, item):
    total, up, down = answers.sum(axis=1), 0.0, 0.0
    for score in np.unique(total):
        here, right = total == score, answers[:, item] == 1
        table = [np.sum(here & (focal == group) & (right == answer)) for group in (False, True) for answer in (True, False)]
        up, down = up + table[0] * table[3] / here.sum(), down + table[1] * table[2] / here.sum()
    return -2.35 * np.log(up / down)


rng = np.random.default_rng(1)
ability = np.concatenate([rng.normal(0.75, 1, 600), rng.normal(-0.75, 1, 600)])
chance = 1 / (1 + np.exp(-(ability[:, None] - np.linspace(-1.5, 1.5, 10))))
answers = (rng.uniform(size=chance.shape) < chance).astype(float)
model, focal = RaschModel(), np.arange(1200) >= 600
model.fit(ResponseData(answers))
table = DIFAnalysis(model, np.where(focal, "f", "r"), "r", "f").analyze().summary()
right = np.array([mantel_haenszel(answers, focal, item) for item in range(10)])
print("delta by rasch-per:", np.round(table["ets_delta"].to_numpy(), 1), "classes", "".join(table["ets_class"]))
print("Mantel-Haenszel's delta:", np.round(right, 1), "items flagged by Lord's chi-squared:", int(table["flag"].sum()))
print("rasch-per", meta.version("rasch-per"))
still = set(table["ets_class"]) == {"C"} and table["ets_delta"].min() > 2 and np.abs(right).max() < 1 and not table["flag"].any()
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
