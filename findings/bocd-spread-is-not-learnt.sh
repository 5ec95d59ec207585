#!/usr/bin/env bash
# bocd does not learn the spread of the data: it expects an SD of 1.4, be the data's 0.1 or 10.
#
# Expected: docstring of StudentT: normal-gamma prior; its update follows Murphy (2007), where beta becomes beta + kappa (x -
#   mu)^2 / (2 (kappa + 1)). After 100 values the SD of the prediction is that of the data.
# Seen: kappa stands in the place of the first beta: beta is the number of values, plus the last one's distance. The SD is 1.41
#   for data with 0.1, and 1.6 for data with 10. A step of 0.5 with an SD of 0.1 is not found in 100 values; 200 values
#   without a change and with an SD of 10 are cut into runs of 14 at most.
# Hurts: the result depends on the unit: MEPs in mV never change, in microvolts they change all the time.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps bocd==0.1.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from bocd import BayesianOnlineChangePointDetection, ConstantHazard, StudentT


class ByTheFormula(StudentT):
    """The same with beta where it belongs."""

    def update_params(self, x):
        beta = self.betaT + self.kappaT * (x - self.muT) ** 2 / (2 * (self.kappaT + 1))
        super().update_params(x)
        self.betaT = np.concatenate([self.beta0, beta])


def runs(kind, values):
    """The most probable run length at each value, and the SD of the prediction for the longest run."""
    detector = BayesianOnlineChangePointDetection(ConstantHazard(250), kind(mu=0, kappa=1, alpha=1, beta=1))
    lengths = []
    for value in values:
        detector.update(value)
        lengths.append(int(detector.rt[0]))
    one = detector.distribution
    return lengths, float(np.sqrt(one.betaT * (one.kappaT + 1) / (one.alphaT * one.kappaT))[-1])


rng = np.random.default_rng(1)
noise = rng.normal(size=200)
step = 0.1 * noise + 0.5 * (np.arange(200) >= 100)
seen = {}
for kind in (StudentT, ByTheFormula):
    small = runs(kind, step[:100])[1]
    last = runs(kind, step)[0][-1]
    lengths, large = runs(kind, 10 * noise)
    seen[kind.__name__] = small, last, large, max(lengths)
    print(f"{kind.__name__}: SD 0.1 is {small:.2f}, SD 10 is {large:.1f}; run length 100 after a step of 0.5: {last}; "
          f"longest run of 200 values without a change: {max(lengths)}")
print("bocd", meta.version("bocd"))
(small, last, large, longest), right = seen["StudentT"], seen["ByTheFormula"]
still = 1.3 < small < 1.5 and last == 200 and large < 3 and longest < 30 and right[1] in (99, 100, 101) and right[3] == 200
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
