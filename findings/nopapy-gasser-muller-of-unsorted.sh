#!/usr/bin/env bash
# NopaPy's Gasser-Mueller estimate needs sorted points and does not say so: a sine's value is -2.75 by the order of the trials.
#
# Expected: docstring of GMEstimate: x is the independent variable, y the dependent one; nothing on their order, and the package's two other
#   estimates, of Nadaraya and Watson and by local polynomials, do not depend on it. An average of values lies between them.
# Seen: the weights are integrals between the midpoints of neighbours in the list, which overlap or are negative if the list is not
#   sorted. Of 21 points of a sine in random order the estimate at 5 is -2.75 for -0.84, outside all values. There is no warning.
# Hurts: intensities or intervals in the random order in which they were given.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps nopapy==1.0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from nopapy.estimate.estimate import GMEstimate, LPEstimate, NWEstimate

x = np.linspace(0, 10, 21)
y = np.sin(x)
order = np.random.default_rng(1).permutation(21)
seen = {}
for name, estimate in (("Nadaraya-Watson", NWEstimate), ("local polynomial", LPEstimate), ("Gasser-Mueller", GMEstimate)):
    seen[name] = [float(estimate(x[index], y[index], 5.0, h=0.5)) for index in (slice(None), order)]
    print(f"{name}: sorted {seen[name][0]:.3f}, in random order {seen[name][1]:.3f}")
print(f"the sine at 5: {np.sin(5):.3f}")
print("nopapy", meta.version("nopapy"))
still = all(abs(a - b) < 1e-9 for name, (a, b) in seen.items() if name[0] != "G") and abs(seen["Gasser-Mueller"][0] - np.sin(5)) < 0.2
still &= abs(seen["Gasser-Mueller"][1] - seen["Gasser-Mueller"][0]) > 0.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
