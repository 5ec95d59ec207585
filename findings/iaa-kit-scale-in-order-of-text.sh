#!/usr/bin/env bash
# iaa-kit's weighted kappa sorts a scale as text: 10 lies between 1 and 2, and a kappa of 0.99 is 0.41.
#
# Expected: its readme: weighted kappa for rubrics of ordered labels; a kappa with linear or quadratic weights counts how many
#   steps of the scale two raters are apart, and is the same if the scale begins at 0 or at 1.
# Seen: labels are sorted by their text, so that 10 comes after 1. Two raters who are one step apart, 9 and 10, are eight
#   steps apart. Ratings from 0 to 9 have a quadratic kappa of 0.99, the same plus one of 0.41. (Labels that nobody used are
#   left out of the scale, too.)
# Hurts: every scale that reaches 10 (pain from 0 to 10, MEP classes), and words such as "low", "medium", "high".
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 iaa-kit==0.1.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from iaa_kit import weighted_kappa

first = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 2, 9]
second = [1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 2, 10]  # the same but for two ratings that are one step apart
seen = {}
for weight in ("linear", "quadratic"):
    from_one = weighted_kappa(first, second, weight)
    from_zero = weighted_kappa([one - 1 for one in first], [one - 1 for one in second], weight)
    seen[weight] = round(from_zero, 2), round(from_one, 2)
    print(f"{weight} kappa of two raters: {from_zero:.3f} on a scale from 0 to 9, {from_one:.3f} on one from 1 to 10")
print("iaa-kit", meta.version("iaa-kit"))
still = seen == {"linear": (0.95, 0.61), "quadratic": (0.99, 0.41)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
