#!/usr/bin/env bash
# gazerr's interval of level 0.95 leaves out 5 % at each end: it holds 90 %.
#
# Expected: the table of extract_intervals has the columns Level, Lower and Upper for 0.99, 0.95, 0.90 and 0.80; its readme:
#   a measured duration of gaze is bounded. Between the bounds of level 0.95 lies the true duration with 95 %.
# Seen: 1 - level is left out below and above: 0.99 is 98 %, 0.95 is 90 %, 0.80 is 60 %.
# Hurts: durations of gaze look more certain than they are; who compares an interval with a chance level finds too many.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.2.6 pandas==2.3.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps gazerr==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from gazerr.estimate import extract_intervals

still = True
durations = np.arange(1000)  # ms
for name, posterior in (("uniform", np.full(1000, 0.001)), ("normal", np.exp(-0.5 * ((durations - 500) / 100) ** 2))):
    posterior = posterior / posterior.sum()
    for row in extract_intervals(posterior, [0.99, 0.95, 0.90, 0.80], 1).itertuples():
        held = posterior[(durations >= row.Lower) & (durations <= row.Upper)].sum()
        print(f"{name} posterior, level {row.Level:.0%}: {row.Lower:.0f} to {row.Upper:.0f} ms hold {held:.1%}")
        still &= bool(abs(held - (2 * row.Level - 1)) < 0.01)
print("gazerr", meta.version("gazerr"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
