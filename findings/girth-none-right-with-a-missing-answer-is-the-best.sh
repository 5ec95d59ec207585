#!/usr/bin/env bash
# girth gives who answered nothing right the highest ability when one answer is missing: 4 for -4.
#
# Expected: docstring of ability_mle: who has all or nothing right cannot be estimated; no_estimate is used, with a minus for those
#   who have nothing right. Missing answers are marked with INVALID_RESPONSE and left out.
# Seen: the minus is set where the lowest value is 0, and the mark of a missing answer is -99999. With it five of five wrong answers
#   have +4, as much as all right; with six of six -4.
# Hurts: persons who detect nothing and miss one trial are the most sensitive ones of the sample.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps girth==0.8.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from girth import ability_mle, tag_missing_data

answers = np.zeros((6, 4), int)  # items by persons
answers[:, 1] = 1
answers[:3, 2] = 1
answers[5, 3] = 9  # not answered
answers = tag_missing_data(answers, [0, 1])
ability = ability_mle(answers, np.linspace(-1, 1, 6), 1.0, no_estimate=4.0)
for who, value in zip(("none of 6 right", "6 of 6 right", "3 of 6 right", "none of 5 right, one missing"), ability):
    print(f"{who}: ability {value:.2f}")
print("girth", meta.version("girth"))
still = ability[0] == -4 and ability[1] == 4 and abs(ability[2]) < 3 and ability[3] == 4
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
