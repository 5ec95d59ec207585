#!/usr/bin/env bash
# msprt decides one observation late for yes-or-no data, and calls a rejection at the last observation an acceptance.
#
# Expected: n_rejection is the smallest number of observations at which the test rejects, that is, at which the ratio is above 1 /
#   alpha; the decision is then "Accept H1".
# Seen: for Bernoulli data the ratio of the first i observations is stored at the place of i + 1: 12 pairs are needed where 11
#   suffice, and the last pair is never used. For both kinds of data a ratio above 1 / alpha at the last observation is "Accept
#   H0": with exactly 22 pairs H0 is accepted at a ratio of 33, with 23 pairs H1 after 22.
# Hurts: who tests after each trial, as the test is meant, is told to accept H0 at the trial that decides, and has to do one
#   more; for yes-or-no data two more.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps msprt==0.1.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from msprt import msprt


def test(first, second, count, kind):
    """Decision, number of observations and largest ratio for the first pairs."""
    sigma, warmup = (1.0, 5) if kind == "normal" else (0.5, 10)
    result = msprt(x=first[:count], y=second[:count], sigma=sigma, distribution=kind, warmup_observations=warmup)
    return result.decision, result.n_rejection, float(max(result.sequential_probability_ratio))


rng = np.random.default_rng(3)
normal = rng.normal(size=40) + 1, rng.normal(size=40)
yes_no = np.array([1.0, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]), np.array([0.0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0])
seen = {}
for kind, pairs in (("normal", normal), ("bernoulli", yes_no)):
    needed = test(*pairs, len(pairs[0]), kind)[1]
    seen[kind] = [(count - needed, *test(*pairs, count, kind)) for count in range(needed - 1, needed + 2)]
    for more, decision, number, ratio in seen[kind]:
        print(f"{kind}, {needed + more} pairs: {decision} after {number}, largest ratio {ratio:.3g} (limit 20)")
print("msprt", meta.version("msprt"))
accepted = {kind: [one[1] for one in rows] for kind, rows in seen.items()}
ratios = {kind: [one[3] > 20 for one in rows] for kind, rows in seen.items()}
still = (
    accepted == dict.fromkeys(seen, ["Accept H0", "Accept H0", "Accept H1"])
    and ratios == dict.fromkeys(seen, [False, True, True])
)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
