#!/usr/bin/env bash
# cenreg's survival at times that are whole numbers is 1 or 0, nothing between.
#
# Expected: documentation of KaplanMeierDistribution.survival_function: survival rates for the values t, an array of the same
#   shape. For events at 2, 3, 7 and 8 and two censored times they fall from 1 over 0.83 and 0.67 to 0.22.
# Seen: the result has the type of t. For [2, 3, 7] it is [0, 0, 0], for [2.0, 3.0, 7.0] it is [0.83, 0.67, 0.44]; cdf, which
#   is made of it, is 1 from the first event on. (Beyond that, the interval at the last, censored time has no width: 0.22
#   to 0.22, after 0.01 to 0.61.)
# Hurts: numbers of trials, days or milliseconds until a response: all seem to have it at the first event.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps cenreg==0.1.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from cenreg.model.kaplan_meier import KaplanMeierDistribution

times = np.array([2, 3, 5, 7, 8, 9])
events = np.array([True, True, False, True, True, False])
model = KaplanMeierDistribution()
model.fit(times, events, alpha=0.05)
seen = {}
for at in (np.array([2, 3, 7]), np.array([2.0, 3.0, 7.0])):
    seen[at.dtype.kind] = model.survival_function(at).round(2).tolist(), model.cdf(at).round(2).tolist()
    print(f"{at.tolist()}: survival {seen[at.dtype.kind][0]}, cdf {seen[at.dtype.kind][1]}")
ends = [(round(float(low), 2), round(float(high), 2)) for low, high in zip(model.survival_rates_lb, model.survival_rates_ub)]
print("times", model.bins.tolist(), "intervals", ends)
print("cenreg", meta.version("cenreg"))
still = seen == {"i": ([0, 0, 0], [1, 1, 1]), "f": ([0.83, 0.67, 0.44], [0.17, 0.33, 0.56])} and ends[-1] == (0.22, 0.22)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
