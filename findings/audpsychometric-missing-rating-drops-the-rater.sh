#!/usr/bin/env bash
# audpsychometric drops a rater for one missing rating, not the item: agreements move up, and the weighted estimate raises.
#
# Expected: documentation of rater_agreement: one agreement for each rater, items in rows and raters in columns. Its source says that
#   items (rows) are removed that miss a rating; evaluator_weighted_estimator weights each rater's ratings with these.
# Seen: columns are removed. With one missing rating among ten items of three raters there are two agreements for three raters, and
#   if the first rater's is missing they belong to the second and third. The estimate raises ValueError.
# Hurts: real panels, in which a rating is always missing somewhere: the wrong rater is judged, or there is no gold standard.
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

import numpy as np
from audpsychometric import evaluator_weighted_estimator, rater_agreement

rng = np.random.default_rng(1)
truth = rng.normal(size=10)
ratings = truth[:, None] + rng.normal(size=(10, 3)) * [1.0, 0.1, 0.3]  # the first rater is the worst
whole = rater_agreement(ratings)
print("complete:", whole.round(3), "for three raters")
ratings[4, 0] = np.nan
gap = rater_agreement(ratings)
print("one rating of the first rater missing:", gap.round(3))
print("without that item:", rater_agreement(np.delete(ratings, 4, axis=0)).round(3))
try:
    print(evaluator_weighted_estimator(ratings))
    raised = False
except ValueError as error:
    print("weighted estimate:", repr(error))
    raised = True
print("audpsychometric", meta.version("audpsychometric"))
still = whole.shape == (3,) and gap.shape == (2,) and raised
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
