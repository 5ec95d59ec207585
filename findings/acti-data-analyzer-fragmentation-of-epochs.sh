#!/usr/bin/env bash
# acti-data-analyzer's intradaily variability is that of epochs, not of hours (0.015 for 0.86), and L5 and M10 are not in a row.
#
# Expected: docstring of SimpleNonparametric: as Witting and others (1990): intradaily variability, higher for more fragmented
#   days, is made of hourly activity, L5 and M10 of the 5 and 10 hours in a row with least and most activity of the average day.
#   Its window is set to 60 minutes.
# Seen: only the interdaily stability is made of hours. The variability compares epochs: the same days have 0.015 with epochs of
#   60 s, 0.008 with 30 s and 0.002 with 5 s; by hours 0.86. L5 and M10 take the hours in order of activity: the
#   hours of a nap at midday are part of the night's L5, and M10 leaves it out (51 for 41).
# Hurts: every comparison with published values: nobody is fragmented, and a nap makes nights quieter and days more active.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.3.5 scipy==1.16.3 pandas==2.3.3 matplotlib==3.10.8 \
    acti-data-analyzer==1.0.4
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from ada.data_containers.generic import GenericData
from ada.long.nonparametric import SimpleNonparametric

days = 7
by_hour = np.random.default_rng(1).uniform(0.5, 1.5, 24 * days)
seen, right = {}, {}
for epoch in (60, 30, 5):  # s
    hours = np.arange(days * 86400 // epoch) * epoch / 3600
    clock = hours % 24
    activity = np.where((clock >= 7) & (clock < 23), 50.0, 2.0)
    activity[(clock >= 13) & (clock < 15)] = 1.0  # a nap
    activity *= np.repeat(by_hour, 3600 // epoch)
    activity += np.random.default_rng(2).normal(0, 0.5, activity.size)
    data = GenericData(np.vstack([hours * 3600, activity]), {"mesa_id": 1}, 1 / epoch, ["timestamp", "activity"])
    seen[epoch] = SimpleNonparametric().fit(data, "activity").fit_params
    means = activity.reshape(24 * days, -1).mean(axis=1)
    day = means.reshape(days, 24).mean(axis=0)
    twice = np.concatenate([day, day])
    right[epoch] = (
        float((np.diff(means) ** 2).mean() / means.var()),
        float(min(twice[first : first + 5].mean() for first in range(24))),
        float(max(twice[first : first + 10].mean() for first in range(24))),
    )
    print(f"epochs of {epoch} s: variability {seen[epoch]['IV']:.4f}, L5 {seen[epoch]['L5']:.2f}, M10 {seen[epoch]['M10']:.1f}", end="; ")
    print(f"by the definition {right[epoch][0]:.2f}, {right[epoch][1]:.2f} and {right[epoch][2]:.1f}")
print("acti-data-analyzer", meta.version("acti-data-analyzer"))
still = all(seen[one]["IV"] < 0.03 and right[one][0] > 0.5 for one in seen) and seen[5]["IV"] < seen[60]["IV"] / 4
still &= seen[60]["L5"] < right[60][1] and seen[60]["M10"] > 1.15 * right[60][2]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
