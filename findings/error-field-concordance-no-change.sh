#!/usr/bin/env bash
# ErrorFieldConcordance has no value, or raises, as soon as two successive measurements are alike.
#
# Expected: readme: the observations of a person in their order, as lists or arrays; the value is a number between -100 and 100,
#   near 0 where there is little overall change. Each change has its length as its weight (Rinehart et al., 2025): none has 0.
# Seen: with arrays one pair without a change (6.2 and 6.3 twice) makes the concordance and its SD nan; with lists of the same
#   numbers it raises ZeroDivisionError, which it also does if the first device alone does not change.
# Hurts: monitors show a tenth of a litre or a whole beat, so that in any longer series two readings are alike: the whole study
#   has no value, or those persons are left out who changed least.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 pandas==3.1.1 matplotlib==3.11.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps ErrorFieldConcordance==1.1
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import math
import sys

import numpy as np
from ErrorFieldConcordance.ErrorFieldConcordance import ErrorFieldConcordance

ask = {"silent": True, "weight_histogram": False, "print_weight_table": False}


def tried(first, second):
    try:
        return [float(one) for one in ErrorFieldConcordance(first, second, **ask)]
    except ZeroDivisionError as error:
        return type(error).__name__


first, second = [5.0, 6.0, 5.5, 7.0, 6.2], [5.1, 6.2, 5.4, 6.8, 6.3]  # litres a minute
alike = first + [6.2, 7.4, 6.0], second + [6.3, 7.5, 5.9]
held = first + [6.2, 7.4, 6.0], second + [6.4, 7.5, 5.9]
seen = {
    "all change": tried(np.array(first), np.array(second)),
    "one pair alike, arrays": tried(np.array(alike[0]), np.array(alike[1])),
    "one pair alike, lists": tried(*alike),
    "first device alike once, lists": tried(*held),
}
for case, one in seen.items():
    print(f"{case}: {one}")
print("ErrorFieldConcordance", meta.version("ErrorFieldConcordance"))
all_change, arrays, lists, one_device = seen.values()
still = all_change[0] > 80 and all(map(math.isnan, arrays)) and lists == one_device == "ZeroDivisionError"
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
