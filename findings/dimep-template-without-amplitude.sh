#!/usr/bin/env bash
# dimep's MEP amplitude after Guggenberger has no amplitude: 50 and 1000 uV have 0.80 and 0.81.
#
# Expected: docstring of guggenberger: estimates the amplitude of an ipsilateral MEP, by the cross-correlation of the signal with a
#   template; the other estimates of the package rise with the MEP.
# Seen: the signal is divided by its own norm first, so that what is returned is how much it looks like the template, between 0 and
#   1. MEPs with peaks of 50, 100, 500 and 1000 uV have 0.802, 0.807, 0.808 and 0.808, noise alone 0.226.
# Hurts: the estimate is in the same table as the other amplitudes (dimep.api.all): a recruitment curve made with it is flat, and so
#   is any effect.
# (Needs a Python before 3.12, as it needs pkg_resources and a scipy before 1.10.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.23.5 scipy==1.9.3 setuptools==65.5.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps dimep==0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from dimep.algo import bawa, guggenberger


def sweep(response, rate, offset=0.0):
    """0.3 s of EMG in uV, pulse at 0.15 s, noise with an SD of 2 uV."""
    time = np.arange(round(0.3 * rate)) / rate - 0.15
    return time, response(time) + offset + np.random.default_rng(3).normal(0, 2, time.size)


def biphasic(time, onset, duration, peak):
    inside = (time >= onset) & (time < onset + duration)
    return np.where(inside, peak * np.sin(2 * np.pi * (time - onset) / duration), 0.0)


seen = {}
for peak in (0, 50, 100, 500, 1000):
    _, emg = sweep(lambda time: biphasic(time, 0.020, 0.020, peak), 1000)
    seen[peak] = float(guggenberger(emg, 150, 1000))
    print(f"MEP with a peak of {peak} uV: peak to peak {bawa(emg, 150, 1000):.0f} uV, by the template {seen[peak]:.3f}")
print("dimep", meta.version("dimep"))
sizes = [seen[peak] for peak in (50, 100, 500, 1000)]
still = max(sizes) - min(sizes) < 0.02 and 0.75 < min(sizes) < 0.9 and seen[0] < 0.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
