#!/usr/bin/env bash
# ocpdet does not find a change of the spread: its Lepage statistic, the default, is Wilcoxon's rank sum, and with Mood's each
# second value is a change.
#
# Expected: documentation of TwoSample: 'Lepage' is for changes in both location and scale, 'Mann-Whitney' for location, 'Mood' for
#   scale. Lepage's statistic is the sum of the squares of both.
# Seen: 'Lepage' is scipy's ranksums, the statistic of location alone. Forty values with an SD of 1, then forty with an SD of 8,
#   have no change; at the true place it is 0.8, Lepage's sum is 39. Mood's statistic of one value and another is not a number,
#   which is taken for one beyond the threshold: 80 values without any change have 39 of them.
# Hurts: MEPs that vary more after an intervention, or a worse contact of the electrodes: the default looks as if it were watched.
# (Only this class is loaded: another one needs tensorflow.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps ocpdet==0.0.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

import numpy as np
from scipy.stats import mood, ranksums

package = sys.modules["ocpdet"] = types.ModuleType("ocpdet")
package.__path__ = [str(meta.distribution("ocpdet").locate_file("ocpdet"))]
from ocpdet.TwoSample import TwoSample

noise = np.random.default_rng(1).normal(size=80)
spread = np.where(np.arange(80) < 40, noise, 8 * noise)
location = noise + 3 * (np.arange(80) >= 40)
seen = {}
for name, data in (("nothing", noise), ("the location", location), ("the spread", spread)):
    for statistic in ("Lepage", "Mood"):
        detector = TwoSample(statistic, threshold=4.0)
        detector.process(list(data))
        seen[name, statistic] = found = [int(one) for one in detector.changepoints]
        print(f"{name} changes at 40: {statistic} finds {len(found)} changes {found[:3]}")
detector = TwoSample()
detector.fetch_statistic()
ours = abs(detector.statistic(spread[:40], spread[40:])[0])
lepage = ranksums(spread[:40], spread[40:])[0] ** 2 + mood(spread[:40], spread[40:])[0] ** 2
print(f"at the change of the spread: 'Lepage' {ours:.2f}, Lepage's sum {lepage:.1f}; default is {detector.statistic.__name__}")
print("ocpdet", meta.version("ocpdet"))
every_second = list(range(2, 80, 2))
still = (
    detector.statistic is ranksums
    and [len(seen[name, "Lepage"]) for name in ("nothing", "the location", "the spread")] == [0, 1, 0]
    and all(seen[name, "Mood"] == every_second for name in ("nothing", "the location", "the spread"))
)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
