#!/usr/bin/env bash
# randomization's simple() changes the list of probabilities that it is given: the second call has others. Its groups are
# numbered from one, or with probabilities from zero.
#
# Expected: documentation of simple: p holds the probability of each group; the result has the groups' numbers.
# Seen: p is replaced by its cumulative sum. With 0.25, 0.25 and 0.5 the first call is right; a second one with the same list
#   gives 0.25, 0.5 and 0.25: the last two groups have changed places. Without p the groups are 1, 2 and 3, with it 0, 1 and 2.
# Hurts: studies with several sites or strata, which call it in a loop: from the second stratum on the shares are others, and
#   a script that names groups by number takes one for another.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check randomization==1.0.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from randomization import simple

shares, seen = [0.25, 0.25, 0.5], []
for stratum in (1, 2):
    before = list(shares)
    groups = simple(20000, 3, shares, seed=1)
    seen.append([round(groups.count(group) / len(groups), 2) for group in range(3)])
    print(f"stratum {stratum}: p before {before}, after {shares}; shares of groups 0, 1, 2: {seen[-1]}")
without = sorted(set(simple(1000, 3, seed=1)))
print("groups without p:", without)
print("randomization", meta.version("randomization"))
still = seen == [[0.25, 0.25, 0.5], [0.25, 0.5, 0.25]] and shares == [0.25, 0.75, 1.75] and without == [1, 2, 3]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
