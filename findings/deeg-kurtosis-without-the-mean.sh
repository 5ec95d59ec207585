#!/usr/bin/env bash
# deeg does not subtract the mean in its kurtosis: noise has 3 around zero, 43 around 2 SD and 10,600 around 10.
#
# Expected: docstring: 'Calculate the feature "kurtosis" of the EEG signal'. Kurtosis is the fourth moment about the mean divided by the fourth
#   power of the standard deviation (Pearson 1905; scipy.stats.kurtosis): 3 for normal noise, wherever its mean is.
# Seen: the fourth moment about zero is divided by the fourth power of the SD. The skewness in the same file is that about the mean. With an
#   electrode's offset of 2 SD the kurtosis is 44, of 10 SD more than 10,000.
# Hurts: detection of artefacts by kurtosis, and classifiers trained on it: it measures the offset of each channel.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps deeg==1.0.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import importlib.util
import sys

import numpy as np
from scipy import stats

# The features alone: the package itself imports torch and MNE for its models.
where = next(file.locate() for file in meta.files("deeg") if str(file).endswith("deeg/features.py"))
spec = importlib.util.spec_from_file_location("features", where)
features = importlib.util.module_from_spec(spec)
spec.loader.exec_module(features)

noise, seen = np.random.default_rng(1).normal(size=5000), {}
for offset in (0, 2, 10):
    signal = 15 * (noise + offset)
    seen[offset] = (float(features.kurtosis(signal)), float(features.skewness(signal)))
    right = (float(stats.kurtosis(signal, fisher=False)), float(stats.skew(signal)))
    print(f"offset {offset} SD: kurtosis {seen[offset][0]:.2f}, right {right[0]:.2f}; skewness {seen[offset][1]:.2f}, right {right[1]:.2f}")
print("deeg", meta.version("deeg"))
still = 2.8 < seen[0][0] < 3.2 and 40 < seen[2][0] < 48 and seen[10][0] > 1e4 and abs(seen[10][1] - seen[0][1]) < 0.01
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
