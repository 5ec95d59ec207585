#!/usr/bin/env bash
# randomization gives all persons one and the same order of treatments.
#
# Expected: documentation of random_treatment_order: a list with one list a subject, each the treatment order of that subject;
#   "those treatments should be randomized".
# Seen: one list is shuffled again for each person and put into the result each time: all entries are that list, in its last
#   order. 20 persons with four treatments have one order, whatever the seed.
# Hurts: crossover studies: the order of intervals, sites or sham is not balanced, and its effect (fatigue, learning, drift)
#   is that of the treatments.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check randomization==1.0.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from randomization import random_treatment_order

counts = []
for seed in (1, 2, 3):
    orders = random_treatment_order(20, 4, seed=seed)
    counts.append(len({tuple(order) for order in orders}))
    print(f"seed {seed}: {len(orders)} persons, orders of four treatments that occur: {counts[-1]} ({orders[0]})")
orders = random_treatment_order(3, 4, seed=1)
orders[0].reverse()
print("the first person's order reversed:", orders)
print("randomization", meta.version("randomization"))
still = counts == [1, 1, 1] and orders[0] == orders[1] == orders[2]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
