#!/usr/bin/env bash
# bootstrap-CIHT's one-sided test has the distance for the direction: a mean far below zero is significantly greater.
#
# Expected: readme: h_sides=1 with h1_dir "greater" tests whether the experiment's parameter is greater than that of the control,
#   or of the null; "less" whether it is smaller. Of the two p values one is small at most; they add up to about one.
# Seen: the absolute difference is compared with the upper or the lower tail: for a mean of -0.9 (30 values, standard error
#   0.15) p is 0.0000 for "less" and for "greater", too; for a mean of 0.2 it is 0.11 and 0.09. Its own one-sided interval of the
#   first, -1.2 to infinity, does hold zero.
# Hurts: an effect against the hypothesis is reported as one for it.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 pandas==3.1.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps bootstrap-CIHT==0.1.1
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import contextlib
import importlib.metadata as meta
import io
import sys

import numpy as np
import pandas as pd
from bootstrap_CIHT import Bootstrap_CIHT

values = np.random.default_rng(1).normal(0, 1, 30)
seen = {}
for mean in (-0.9, 0.2, 0.9):
    data = pd.DataFrame({"x": values - values.mean() + mean})
    for direction in ("greater", "less"):
        with contextlib.redirect_stdout(io.StringIO()):
            test = Bootstrap_CIHT(data, "x", h_sides=1, h1_dir=direction, samples=500)
            means = test.get_bootstrap_sample()
            seen[mean, direction] = float(test.calculate_hypothesis_test(means))
            low, high = (float(one) for one in test.calculate_CI(means))
        print(f"mean {mean:+.1f}, {direction}: p = {seen[mean, direction]:.4f}, 95 % interval {low:.2f} to {high:.2f}")
print("bootstrap-CIHT", meta.version("bootstrap-CIHT"))
still = seen[-0.9, "greater"] < 0.001 and seen[0.9, "less"] < 0.001 and seen[0.2, "greater"] + seen[0.2, "less"] < 0.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
