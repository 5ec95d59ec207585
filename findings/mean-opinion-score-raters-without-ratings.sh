#!/usr/bin/env bash
# mean-opinion-score counts raters who rated nothing: the 95 % interval of three raters is +-1.80, with two empty rows besides +-1.16.
#
# Expected: docstring of get_ci95: "Computes the 95% confidence interval" from a matrix in which "Unknown ratings are represented by NaN"
#   (Ribeiro et al., ICASSP 2011: Student's t with the smaller number of subjects or sentences less one). A row of NaN alone holds nothing.
# Seen: the degrees of freedom come from the shape of the matrix, empty rows and columns included. The variance stays as it is, the factor
#   goes from 4.30 with three raters to 2.78 with two empty rows besides. The example of its documentation has such a row.
# Hurts: tables of all who were invited, of whom few answered: the fewer come, the more exact the mean seems.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps mean-opinion-score==0.0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from mean_opinion_score import get_ci95, get_mos

gap = np.nan
ratings = np.array([[4, 5, gap, 4, gap, 3], [4, 4, 4, 5, gap, 4], [gap, 3, 5, 4, gap, 1]], dtype=float)[:, [0, 1, 2, 3, 5]]
seen = {}
for empty in (0, 1, 2, 5):
    table = np.vstack([ratings, np.full((empty, 5), gap)])
    seen[empty] = float(get_ci95(table))
    print(f"three raters and {empty} without a rating: {get_mos(table):.2f} +- {seen[empty]:.2f}")
print("mean-opinion-score", meta.version("mean-opinion-score"))
still = seen[0] > 1.25 * seen[1] > 1.25 * seen[2] and seen[2] == seen[5] and seen[0] > 1.5 * seen[5]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
