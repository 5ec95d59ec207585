#!/usr/bin/env bash
# audpsychometric rounds the mode to a whole number: of three ratings of 2.5 it is 3, on which nobody agrees.
#
# Expected: docstring of mode: if there are several winning categories of numbers, their average is rounded to the next higher
#   integer. If one wins, it is the mode; agreement_categorical is the share of raters whose rating equals the mode.
# Seen: a single winner is rounded, too. Three ratings of 2.5 have the mode 3 and an agreement of 0; 1.5, 1.5 and 2 have the mode 2
#   and an agreement of a third; 0.1, 0.1 and 0.9 have 0.
# Hurts: scales with half points, or ratings between 0 and 1 and between -1 and 1: the gold standard is a category that nobody chose.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.0.2 pandas==2.3.3 scipy==1.15.3 scikit-learn==1.9.1 \
    statsmodels==0.15.0 pingouin==0.6.1 audeer==2.7.0 audmetric==1.4.2 audpsychometric==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from audpsychometric import agreement_categorical, mode

seen = []
for ratings in ([2, 2, 3], [2.5, 2.5, 2.5], [1.5, 1.5, 2], [0.1, 0.1, 0.9], [-0.5, -0.5, -0.5]):
    seen.append((mode(ratings), round(float(agreement_categorical(ratings)), 2)))
    print(f"{ratings}: mode {seen[-1][0]}, agreement {seen[-1][1]}")
print("audpsychometric", meta.version("audpsychometric"))
still = seen == [(2, 0.67), (3, 0.0), (2, 0.33), (0, 0.0), (0, 0.0)]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
