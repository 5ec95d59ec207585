#!/usr/bin/env bash
# change-point-analyzer finds each change three samples early; its other estimator finds no rise, but the last sample.
#
# Expected: it names Taylor's method: the change is where the mean squared error of two levels is least (Estimator.MSE, the
#   default), or where the cumulative sum is farthest from zero, on either side (Estimator.CUSUM).
# Seen: the search begins at the fourth sample, and its place in the list, not in the data, is returned, with one added: a
#   change after sample 20 is found after 17. The cumulative sum is searched for its maximum only: a fall is found at
#   sample 19, the last one before it; of a rise, where the sum has a minimum, the last sample of all is returned.
# Hurts: the trial at which MEPs change is wrong by three, and parts of the recording that are cut there have trials of
#   both levels; with the cumulative sum facilitation is never found, inhibition is.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps change-point-analyzer==0.0.5
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from change_point_analyzer.main import ChangePointAnalyzer, Estimator

seen = []
for first, count, change in ((20, 40, 1.0), (20, 40, -1.0), (45, 60, 1.0), (45, 60, -1.0)):
    np.random.seed(1)
    data = 0.1 * np.random.default_rng(1).normal(size=count)
    data[first:] += change
    analyzer = ChangePointAnalyzer(data)
    found = [int(analyzer.detect_changepoints(one, recursive=False)[0][0]) for one in (Estimator.MSE, Estimator.CUSUM)]
    seen.append(found)
    print(f"{count} samples, a change of {change:+g} from sample {first} on: MSE {found[0]}, CUSUM {found[1]}")
print("change-point-analyzer", meta.version("change-point-analyzer"))
still = seen == [[17, 39], [17, 19], [42, 59], [42, 44]]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
