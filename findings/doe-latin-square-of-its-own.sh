#!/usr/bin/env bash
# doe analyses every Latin square as if it were the same one: the treatments' effect is lost in the error.
#
# Expected: its documentation: "Latin Square Design" analysed from a table, like the other designs. There are 576 squares of four
#   treatments, and textbooks say to draw one at random; which one was used is not asked for.
# Seen: treatments are summed along the diagonals of one cyclic square. For this one F is right; for another cyclic one, A B C D in the
#   first row and D A B C in the second, a treatment that adds 10 has p = 0.49 for less than 0.001, and 0.84 with the first
#   one's rows in another order.
# Hurts: crossover studies, whose order of conditions is balanced by such a square: whether there is an effect is decided
#   by the square that was drawn.
# (Needs a Python before 3.12, as it needs a numpy before 1.24.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.23.5 scipy==1.10.1 pandas==1.5.3 prettytable==3.18.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation doe==0.1.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import doe
import numpy as np
import pandas as pd
import scipy.stats

SIZE, EFFECTS = 4, np.array([0, 0, 0, 10.0])


def p_value(square, values):
    """The p-value of the treatments, by the usual sums of squares."""
    grand = values.mean()
    parts = [values.mean(axis=1), values.mean(axis=0), np.array([values[square == one].mean() for one in range(SIZE)])]
    sums = [SIZE * ((part - grand) ** 2).sum() for part in parts]
    left = (SIZE - 1) * (SIZE - 2)
    error = (((values - grand) ** 2).sum() - sum(sums)) / left
    return float(scipy.stats.f.sf(sums[2] / (SIZE - 1) / error, SIZE - 1, left))


first = np.array([[(row + column) % SIZE for column in range(SIZE)] for row in range(SIZE)])
squares = {
    "A B C D, B C D A, ...": first,
    "A B C D, D A B C, ...": np.array([[(column - row) % SIZE for column in range(SIZE)] for row in range(SIZE)]),
    "rows of the first in another order": first[[0, 2, 1, 3]],
}
noise = np.random.default_rng(1).normal(size=(SIZE, SIZE))
seen = {}
for name, square in squares.items():
    values = EFFECTS[square] + noise
    pd.DataFrame(values, index=range(1, SIZE + 1)).to_csv("table.csv")
    seen[name] = p_value(square, values), float(doe.latin_square("table.csv").p_value_treatments)
    print(f"{name}: p = {seen[name][0]:.5f}, the package's {seen[name][1]:.5f}")
print("doe", meta.version("doe"))
right, *others = seen.values()
still = abs(right[0] - right[1]) < 1e-6 and all(p < 0.001 and found > 0.1 for p, found in others)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
