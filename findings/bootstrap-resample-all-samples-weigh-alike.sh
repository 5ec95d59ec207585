#!/usr/bin/env bash
# bootstrap-resample's whole bootstrap distribution weighs all samples alike: with six values the error is 0.30 for 0.23.
#
# Expected: docstring of sample: the sampling distribution of the bootstrap; for few values it is said to be calculated entirely. A
#   sample with all six values comes up 720 times as often as one that has the same value six times.
# Seen: each of the 462 combinations counts once. The standard error of the mean is 0.30 for 0.23 (SD by the root of n), and the 95
#   % interval is a third too wide. From eight values on samples are drawn, and it is right.
# Hurts: small groups, for whom it is used, get intervals that are too wide, and an eighth person narrows them at once.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.0.2 scipy==1.15.3 pandas==2.3.3 joblib==1.5.3 progressbar2==4.5.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps bootstrap-resample==0.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from bootstrap_resample import sample

seen = {}
for values in ([0.4, 0.6, 0.9, 1.1, 1.5, 2.1], [0.4, 0.6, 0.9, 1.1, 1.5, 2.1, 0.8, 1.3, 1.7]):
    table = pd.DataFrame({"mep_mv": values})
    np.random.seed(1)
    drawn = sample(table, lambda data: data.mean(), map=map).bootstrap_samples["mep_mv"]
    error, expected = drawn.std(ddof=0), table["mep_mv"].std(ddof=0) / np.sqrt(len(values))
    seen[len(values)] = error / expected
    print(f"{len(values)} values: {len(drawn)} samples, standard error {error:.3f}, expected {expected:.3f}")
print("bootstrap-resample", meta.version("bootstrap-resample"))
still = abs(seen[6] - np.sqrt(12 / 7)) < 0.01 and abs(seen[9] - 1) < 0.08
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
