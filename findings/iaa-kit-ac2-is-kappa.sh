#!/usr/bin/env bash
# iaa-kit's AC2 is weighted kappa: where two raters agree in 118 of 125 it is below 0.
#
# Expected: its readme: Gwet AC1 and AC2. AC2 is AC1 with weights (Gwet 2014): for two labels, or without weights, both are the
#   same. They were made for skewed labels, where kappa falls although raters agree.
# Seen: ac2 returns Cohen's kappa with the weights. For 118 of 125 ratings that agree AC1 is 0.94, AC2 of the same two
#   labels -0.02.
# Hurts: who takes AC2 since kappa fails on rare responses (few MEPs absent, few artefacts) reports kappa under another name.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 iaa-kit==0.1.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from iaa_kit import ac1, ac2, weighted_kappa

first, second = [1] * 118 + [1] * 5 + [2] * 2, [1] * 118 + [2] * 5 + [1] * 2
one = ac1(first, second)
two = {weight: ac2(first, second, weight) for weight in ("linear", "quadratic")}
kappa = {weight: weighted_kappa(first, second, weight) for weight in two}
print(f"118 of 125 agree: AC1 {one:.3f}; AC2 {two['linear']:.3f} and {two['quadratic']:.3f}, weighted kappa {kappa['linear']:.3f}")
graded = [1, 1, 1, 1, 1, 1, 2, 3, 1, 2], [1, 1, 1, 1, 1, 2, 2, 2, 1, 1]
same = [(ac2(*graded, weight), weighted_kappa(*graded, weight)) for weight in two]
print("three labels: AC2 and weighted kappa", *(f"{left:.3f} and {right:.3f}" for left, right in same))
print("iaa-kit", meta.version("iaa-kit"))
still = one > 0.94 and two == kappa and two["linear"] < 0 and all(left == right for left, right in same)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
