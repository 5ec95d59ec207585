#!/usr/bin/env bash
# ProcessMVNX takes out jumps of joint angles by two turns instead of one: 170, 190 and 170 degrees are 170, 550 and 170.
#
# Expected: its name, and use: remove_discontinuities makes joint angles of Xsens files continuous, that jump from 180 to -180 degrees. A turn is
#   360 degrees.
# Seen: between two jumps 720 degrees are added or subtracted, so that the jump of 340 degrees downwards becomes one of 380 upwards. A
#   rise through 180 degrees without a return stays as it is.
# Hurts: shoulders and forearms, which pass 180 degrees; ranges of motion and means of whole files, as parse_mvnx does it to all.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 pandas==2.2.3 transforms3d==0.4.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps ProcessMVNX==0.2.4
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from ProcessMVNX import remove_discontinuities

true = 170 + 20 * np.sin(np.linspace(0, np.pi, 9))[:, None]  # degrees: from 170 to 190 and back
recorded = (true + 180) % 360 - 180
repaired = remove_discontinuities(recorded.copy())
print("joint angle:      ", true[:, 0].round(0).tolist())
print("in the file:      ", recorded[:, 0].round(0).tolist())
print("discontinuities removed:", repaired[:, 0].round(0).tolist())
print("numpy's unwrap:   ", np.unwrap(recorded[:, 0], period=360).round(0).tolist())
rise = np.array([[160.0], [175.0], [-170.0], [-155.0]])
print("160, 175, -170, -155 degrees:", remove_discontinuities(rise.copy())[:, 0].tolist())
print("ProcessMVNX", meta.version("ProcessMVNX"))
still = np.allclose(np.unwrap(recorded[:, 0], period=360), true[:, 0]) and abs(float(repaired.max()) - 550) < 1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
