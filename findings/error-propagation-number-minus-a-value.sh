#!/usr/bin/env bash
# error-propagation turns around what begins with a number: 10 minus 4 ± 1 is -6 ± 1, and 1 by 4 ± 1 is 4 ± 1.
#
# Expected: documentation: values with errors are added, subtracted, multiplied and divided with each other and with numbers. 10 -
#   (4 ± 1) is 6 ± 1, and 1 / (4 ± 1) is 0.25 ± 0.0625.
# Seen: with the number on the left the difference and the quotient are those with it on the right: -6 ± 1 and 4 ± 1, and so in
#   NumPy arrays. With the number as a value without error both are right.
# Hurts: rates of periods (1000 / interval), per cent of a control (100 - change) and conductances come out negative or upside down,
#   with an error that looks right.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps error-propagation==0.0.4
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from error_propagation import Complex

value = Complex(4.0, 1.0)
seen = {
    "10 - x": 10 - value,
    "1 / x": 1 / value,
    "[10] - x": (np.array([10.0]) - value)[0],
    "Complex(10, 0) - x": Complex(10.0, 0.0) - value,
    "Complex(1, 0) / x": Complex(1.0, 0.0) / value,
}
for text, result in seen.items():
    print(f"{text:>18}: {result.value:g} with an error of {result.error:g}")
print("error-propagation", meta.version("error-propagation"))
still = [(one.value, one.error) for one in seen.values()] == [(-6, 1), (4, 1), (-6, 1), (6, 1), (0.25, 0.0625)]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
