#!/usr/bin/env bash
# psychoanalyze's psychometric function depends on the unit of the intensity: in milliampere the threshold is elsewhere than
#   in microampere.
#
# Expected: docstring of blocks.fit: a logistic regression of the trials. Its maximum of likelihood does not depend on the
#   unit: a threshold of 240 uA is one of 0.24 mA, a slope of 0.05 per uA is one of 50 per mA.
# Seen: scikit-learn's regression is used with its default penalty on the slope, which is strong if the numbers are small.
#   With 400 trials around 240 uA both are right in uA; in mA the slope is 8 times too flat and the threshold a tenth too
#   high.
# Hurts: thresholds (-intercept / slope) and slopes of brain or nerve stimulation in mA, V or s are biased, always towards
#   flat; the more so the fewer the trials.
# (The web interface's packages are not installed.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --ignore-requires-python psychoanalyze==0.8.9
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 scikit-learn==1.9.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
from unittest.mock import MagicMock

import numpy as np
import pandas as pd
import sklearn.linear_model
from scipy.optimize import minimize

for name in ("dash", "pandera", "plotly", "plotly.express", "plotly.graph_objects"):
    sys.modules[name] = MagicMock()
from psychoanalyze.data.blocks import fit

rng = np.random.default_rng(1)
level_ua = np.repeat([150.0, 190.0, 230.0, 270.0, 310.0], 80)
felt = (rng.random(level_ua.size) < 1 / (1 + np.exp(-0.05 * (level_ua - 240)))).astype(int)


def most_likely(level):
    scaled = (level - level.mean()) / level.std()
    sign = 2 * felt - 1
    best = minimize(lambda p: np.logaddexp(0, -sign * (p[0] + p[1] * scaled)).sum(), [0.0, 1.0]).x
    slope = best[1] / level.std()
    return level.mean() - best[0] / slope, slope


seen = {}
for unit, level in (("uA", level_ua), ("mA", level_ua / 1000)):
    threshold, slope = most_likely(level)
    stated = fit(pd.DataFrame({"Intensity": level, "Result": felt}))
    seen[unit] = (float(-stated["intercept"] / stated["slope"] - threshold) / threshold, float(slope / stated["slope"]))
    print(f"in {unit}: most likely threshold {threshold:.4g}, slope {slope:.4g}; stated {-stated['intercept'] / stated['slope']:.4g}, {stated['slope']:.4g}")
print("psychoanalyze", meta.version("psychoanalyze"))
still = abs(seen["uA"][0]) < 0.001 and abs(seen["uA"][1] - 1) < 0.01 and seen["mA"][1] > 5 and seen["mA"][0] > 0.05
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
