#!/usr/bin/env bash
# shiftES gives two identical samples a medium to large effect, of either sign, if values are repeated.
#
# Expected: docstring of effectsize: Wilcox's effect size, from -1 to 1, "with 0 indicating no effect"; 0.3 is medium, 0.4 large. The
#   code's own remark says "less than equal". effectsize_ci and the command line call its limits those of the 95 % interval.
# Seen: differences of exactly the median are not counted: a sample against itself has -0.2 (ratings 1 to 5, each as often), -0.5
#   (most persons rate 3) or -0.62 (mostly zeros), in whichever order. Exchanging two samples does not turn the sign into its
#   opposite. The limits of the interval are the 5 and the 95 % quantile, so that it holds 90 %.
# Hurts: ratings, counts and scores, whose values are few: where nothing has changed a drop is reported, and a rise is hidden.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps shiftES==1.0.7
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from shiftES import effectsize, effectsize_ci

samples = {
    "ratings 1 to 5, six of each": np.repeat([1.0, 2, 3, 4, 5], 6),
    "20 of 30 rate 3": np.repeat([2.0, 3, 4], [5, 20, 5]),
    "15 of 20 have no error": np.repeat([0.0, 1], [15, 5]),
    "thirty values, all different": np.random.default_rng(1).normal(size=30),
}
seen = {}
for what, sample in samples.items():
    better = sample + 1
    seen[what] = [float(effectsize(*pair)) for pair in ((sample, sample), (better, sample), (sample, better))]
    itself, one, other = seen[what]
    print(f"{what}: against itself {itself:.2f}; one more against it {one:.2f}, it against one more {other:.2f}")
np.random.seed(1)
rng = np.random.default_rng(2)
one, other = rng.normal(1, 1, 40), rng.normal(0, 1, 40)
held = effectsize_ci(one, other, nboot=4000)
np.random.seed(1)
narrower = effectsize_ci(one, other, nboot=4000, ci=0.025)
print(f"interval of effectsize_ci {held[1]:.2f} to {held[2]:.2f}, with ci=0.025 (2.5 % at each end) {narrower[1]:.2f} to {narrower[2]:.2f}")
print("shiftES", meta.version("shiftES"))
first = [round(one[0], 3) for one in seen.values()]
still = first[:3] == [-0.2, -0.5, -0.625] and abs(first[3]) < 0.05 and held[1] > narrower[1] and held[2] < narrower[2]
still &= all(abs(one[1] + one[2]) > 0.3 for one in list(seen.values())[:3])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
