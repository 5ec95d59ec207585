#!/usr/bin/env bash
# squidward's samples of a fitted classifier are drawn from the prior: the data are not in them.
#
# Expected: docstring of the classifier's posterior_sample: samples of the posterior of the fitted model. Where all of 40
#   responses were "felt", samples are near the prediction; prior_sample is there for those without data.
# Seen: posterior_sample calls prior_sample of each class. 200 samples at a level that was always felt and at one that never
#   was have the same mean and spread, those of the prior; posterior_predict of the same model tells them apart.
# Hurts: uncertainties, thresholds and next stimuli (Thompson sampling) from samples are those of a model that has seen
#   nothing.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps squidward==0.0.25
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from squidward import gpc
from squidward.kernels import distance, kernel_base

np.random.seed(1)
level = np.linspace(0, 10, 40)
felt = (level > 5).astype(int)
model = gpc.GaussianProcess(n_classes=2, kernel=kernel_base.Kernel(distance.RBF(2.0, 1.0)), var_l=0.1, show_warnings=False)
model.fit(level.reshape(-1, 1), felt)
at = np.array([[1.0], [9.0]])
predicted, _ = model.posterior_predict(at, logits=True)
samples = np.array([np.asarray(model.posterior_sample(at, logits=True)).ravel() for _ in range(200)])
predicted = predicted.ravel()
print(f"first class (never felt) at levels 1 and 9: predicted {predicted.round(2).tolist()}")
print(f"200 samples: mean {samples.mean(0).round(2).tolist()}, standard deviation {samples.std(0).round(2).tolist()} (prior: 0 and 1)")
print("squidward", meta.version("squidward"))
still = abs(predicted[0] - predicted[1]) > 1.5 and np.all(np.abs(samples.mean(0)) < 0.3) and np.all(np.abs(samples.std(0) - 1) < 0.2)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
