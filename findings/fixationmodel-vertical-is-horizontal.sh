#!/usr/bin/env bash
# fixationmodel takes the mean of x for that of y: the centroid of gaze at (200, 600) is (200, 200), its error 160,000 for 2.
#
# Expected: its README: a least-squares method to test whether tracked gaze points resemble a fixation. fit returns the centroid of the points and
#   the mean squared error around it.
# Seen: the second mean is made of the horizontal coordinates, too. The centroid lies on the diagonal, the error grows with the distance
#   from it: the same points have an error of 2 at (200, 200) and of 160,002 at (200, 600).
# Hurts: which gaze looks like a fixation depends on where on the screen it is.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps fixationmodel==0.1.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import fixationmodel

shape = [(-1, -1), (-1, 1), (1, -1), (1, 1)]
seen = {}
for middle in ((200, 200), (200, 600)):
    points = [[middle[0] + x, middle[1] + y] for x, y in shape]
    result = fixationmodel.fit(points)
    right = sum((x - middle[0]) ** 2 + (y - middle[1]) ** 2 for x, y in points) / len(points)
    seen[middle] = result["centroid"], round(result["mean_squared_error"])
    print(f"four points around {middle}: centroid {result['centroid']}, error {result['mean_squared_error']:.0f}; by the definition {right:.0f}")
print("fixationmodel", meta.version("fixationmodel"))
still = seen == {(200, 200): ([200.0, 200.0], 2), (200, 600): ([200.0, 200.0], 160002)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
