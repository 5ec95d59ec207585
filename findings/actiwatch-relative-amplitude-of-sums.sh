#!/usr/bin/env bash
# actiwatch's relative amplitude compares the sum of ten hours with that of five: somebody without any rhythm has 0.33.
#
# Expected: docstring of relative_amplitude: the relative amplitude of each day, (M10 - L5) / (M10 + L5), where M10 and L5 are the mean
#   activity of the most active ten and the least active five hours (Van Someren 1999): 0 without a rhythm, 1 if the night is
#   without movement.
# Seen: M10 and L5 are sums over the hours. Constant activity has 0.33 instead of 0; nights half as active as days 0.60 instead of
#   0.33. Only 1 is right.
# Hurts: rest-activity rhythms of patients: all look stronger than they are, the weak ones most, and no cut-off or published
#   value fits.
# (Needs a Python before 3.12, as it needs a pandas before 2.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 pandas==1.5.3 astral==1.10.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps actiwatch==0.2.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from actiwatch.analysis import relative_amplitude

time = pd.date_range("2026-01-05", periods=2 * 1440, freq="min")
seen = {}
for night in (20.0, 10.0, 2.0, 0.0):
    activity = np.where((time.hour >= 8) & (time.hour < 22), 20.0, night)
    table = pd.DataFrame(
        {"DateTime": time, "Hour": time.hour, "Split_Day": np.arange(time.size) // 1440, "Activity": activity, "watch_ID": "P01"}
    )
    expected = (20 - night) / (20 + night)
    seen[night] = round(float(relative_amplitude(table, 0)["RA"].iloc[0]), 2)
    print(f"20 counts a minute by day, {night:.0f} by night: relative amplitude {expected:.2f}, the package's {seen[night]:.2f}")
print("actiwatch", meta.version("actiwatch"))
still = list(seen.values()) == [0.33, 0.6, 0.9, 1.0]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
