#!/usr/bin/env bash
# pycircstat's correlation of an angle with an amplitude does not subtract the mean: it depends on the unit's zero and is above 1.
#
# Expected: docstring of corrcl: the correlation coefficient between a circular and a linear variable (Zar, equ. 27.47), which is made
#   of Pearson's correlations, so that adding a constant to the linear variable changes nothing and it lies from 0 to 1.
#   CL1stOrderRegression.test of the same package uses them.
# Seen: the "correlations" in it are means of products divided by the standard deviations. Of forty amplitudes that do not depend on the
#   phase it is 0.15 around 0, 1.7 around 10 and 17 around 100.
# Hurts: phase-dependence of evoked potentials (MEP amplitude by the phase of the rhythm at the pulse): amplitudes are never
#   around zero, so that an effect is found where there is none.
# (Needs a Python before 3.12, as it needs a pandas before 2.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==1.26.4 scipy==1.11.4 pandas==1.5.3 decorator==5.3.1 nose==1.3.7 setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation pycircstat==0.0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pycircstat

rng = np.random.default_rng(1)
phase = rng.uniform(0, 2 * np.pi, 40)
noise = rng.normal(size=40)


def by_zar(alpha, x):
    """Zar's coefficient, of Pearson's correlations."""
    xc, xs, cs = (np.corrcoef(*pair)[0, 1] for pair in ((x, np.cos(alpha)), (x, np.sin(alpha)), (np.cos(alpha), np.sin(alpha))))
    return np.sqrt((xc**2 + xs**2 - 2 * xc * xs * cs) / (1 - cs**2))


seen = {}
for mean in (0, 1, 10, 100):
    amplitudes = noise - noise.mean() + mean
    seen[mean] = float(pycircstat.corrcl(phase, amplitudes)), float(by_zar(phase, amplitudes))
    print(f"amplitudes around {mean}: corrcl {seen[mean][0]:.2f}, by Zar {seen[mean][1]:.2f}")
print("pycircstat", meta.version("pycircstat"))
still = abs(seen[0][0] - seen[0][1]) < 0.01 and seen[10][0] > 1 and seen[100][0] > 5 and seen[100][1] < 0.4
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
