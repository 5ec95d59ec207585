#!/usr/bin/env bash
# kendall-w takes ratings for ranks and ties for disagreement: raters who agree on everything have 0.33, or a W of 1600.
#
# Expected: docstring of compute_w: Kendall's W of a list of rating lists, in [0, 1]; 0 is no agreement, 1 is unanimous. Kendall
#   and Babington Smith (1939): of the ranks that each rater gives; tied items share the mean rank, and the denominator is
#   smaller by what the ties of each rater make up (Siegel and Castellan, 1988, 9.2).
# Seen: the numbers are summed as they are, and the denominator is that of ranks without ties. Three raters who all rate 1, 2, 2
#   have 0.33 and 1, 1, 3 have 1.33; 10, 50 and 90 (of 100) have W = 1600. Mean ranks cannot be given: only int is taken.
# Hurts: agreement of ratings on a scale, as on the visibility of MEPs or on pain: with ties it is understated or above one.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check kendall-w==1.0.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from kendall_w import compute_w


def ranks(values):
    """Mean ranks, from 1."""
    return [sum(other < value for other in values) + (values.count(value) + 1) / 2 for value in values]


def right(data):
    """Kendall's W with its correction for ties."""
    items, raters = len(data), len(data[0])
    ranked = [ranks(list(column)) for column in zip(*data)]
    sums = [sum(column) for column in zip(*ranked)]
    mean = sum(sums) / items
    ties = sum(column.count(value) ** 3 - column.count(value) for column in zip(*data) for value in set(column))
    return 12 * sum((one - mean) ** 2 for one in sums) / (raters**2 * (items**3 - items) - raters * ties)


seen = {}
for case, data in (
    ("example of its readme", [[1, 1, 1, 2], [2, 2, 2, 3], [3, 3, 3, 1]]),
    ("all rate 1, 2, 2", [[1] * 3, [2] * 3, [2] * 3]),
    ("all rate 1, 1, 3", [[1] * 3, [1] * 3, [3] * 3]),
    ("all rate 10, 50, 90", [[10] * 3, [50] * 3, [90] * 3]),
):
    seen[case] = compute_w(data)
    print(f"{case}: W = {seen[case]:.4g}, by the definition {right(data):.4g}")
try:
    compute_w([[1.0] * 3, [2.5] * 3, [2.5] * 3])
    refused = False
except AssertionError:
    refused = True
print("mean ranks:", "AssertionError" if refused else "taken")
print("kendall-w", meta.version("kendall-w"))
still = [round(one, 2) for one in seen.values()] == [0.44, 0.33, 1.33, 1600.0] and refused
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
