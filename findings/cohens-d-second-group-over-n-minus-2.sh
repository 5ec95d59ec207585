#!/usr/bin/env bash
# cohens_d divides the second group's sum of squares by n - 2: d is too small, and depends on which group is named first.
#
# Expected: docstring of cohensd_2ind: the absolute Cohen's d of two independent samples. It is symmetric, and that of the package's
#   own cohensd_2ind_from_stats, whose pooled deviation has n - 1 for both groups.
# Seen: the second group's variance is made with ddof = 2, the first one's with ddof = 1. With three persons in each group d is
#   1.25 one way round, 1.70 the other, and 1.75 by the other function; with six 2.95, 2.98 and 3.14; with 20 up to 2 % too small.
# Hurts: effect sizes of small groups, which go into meta-analyses and into the next study's sample size.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation cohens-d==0.1.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from cohens_d import cohensd_2ind, cohensd_2ind_from_stats

rng = np.random.default_rng(1)
seen = {}
for number in (3, 6, 20):
    first, second = rng.normal(1, 1, number), rng.normal(0, 1, number)
    stats = first.mean(), second.mean(), first.std(ddof=1), second.std(ddof=1), number, number
    seen[number] = [float(one) for one in (cohensd_2ind(first, second), cohensd_2ind(second, first), cohensd_2ind_from_stats(*stats))]
    print(f"{number} persons in each group: {seen[number][0]:.4f}, exchanged {seen[number][1]:.4f}, by the statistics {seen[number][2]:.4f}")
print("cohens-d", meta.version("cohens-d"))
still = all(max(one[:2]) < one[2] and one[0] != one[1] for one in seen.values()) and seen[3][0] < 0.75 * seen[3][2]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
