#!/usr/bin/env bash
# iaa-kit's alpha differs from Krippendorff's on his own example, for all four scales; ordinal is interval.
#
# Expected: its readme: Krippendorff's alpha with missing data, for nominal, ordinal, interval and ratio scales. Krippendorff's
#   text on computing alpha, example C (four observers, twelve units, missing values): 0.743, 0.815, 0.849, 0.797.
# Seen: 0.720, 0.832, 0.832, 0.776. A pair counts the same in units of two and of four observers, values of units that only one
#   observer rated enter what is expected by chance, and the ordinal distance is that of the interval scale.
# Hurts: agreement of raters with gaps, the case that alpha is chosen for, and on ordinal scales, cannot be compared with
#   published values or thresholds.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 iaa-kit==0.1.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from iaa_kit import alpha_value

OBSERVERS = ("123321412...", "1233224125.3", ".3332342251.", "12332441251.")
PUBLISHED = {"nominal": 0.743, "ordinal": 0.815, "interval": 0.849, "ratio": 0.797}
units = [[None if one == "." else int(one) for one in unit] for unit in zip(*OBSERVERS)]
seen = {scale: round(float(alpha_value(units, scale)), 3) for scale in PUBLISHED}
for scale, right in PUBLISHED.items():
    print(f"{scale}: published {right:.3f}, iaa-kit {seen[scale]:.3f}")
apart = [[1, 2], [1, 1], [2, 2], [2, 2], [9, 9]]  # the ordinal distance depends on ranks only
stretched = [[one * 100 if one == 9 else one for one in unit] for unit in apart]
orders = [float(alpha_value(one, "ordinal")) for one in (apart, stretched)]
print(f"ordinal alpha if the highest label is called 9: {orders[0]:.3f}, if it is called 900: {orders[1]:.5f}")
print("iaa-kit", meta.version("iaa-kit"))
still = seen == {"nominal": 0.72, "ordinal": 0.832, "interval": 0.832, "ratio": 0.776} and orders[1] > 0.9999 > orders[0]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
