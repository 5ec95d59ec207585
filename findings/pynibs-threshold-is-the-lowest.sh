#!/usr/bin/env bash
# pynibs gives the lowest intensity delivered as the motor threshold when every MEP is above 50 uV.
#
# Expected: docstring of Mep: mt is the "Motor threshold (MEP > 50 uV), evaluated from fitted curve". The fitted curve is
#   at 50 uV below the intensities that were delivered; its threshold is there, or there is none (nan, as when no MEP reaches 50 uV).
# Seen: the curve is looked at only between the lowest and the highest intensity, and the first intensity above 50 uV is
#   the threshold: the lowest one delivered, as exact as any other. Nothing is raised or warned.
# Hurts: a recruitment curve that began at 56 % of the output gives a threshold of 56 % in a person whose threshold is 48 %;
#   doses and intensities in % of the threshold follow. Whoever stimulates less low has a higher threshold.
# (pynibs is installed without its drawing and meshing packages, which this class does not need.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pynibs==0.2026.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==1.26.4 scipy==1.17.1 pandas==3.0.6 h5py==3.16.0 matplotlib==3.11.2 lmfit==1.3.4 tqdm==4.70.1 \
    scikit-learn==1.9.1 scikit-image==0.26.0 nibabel==5.4.2 meshio==5.3.5 trimesh==5.2.0 fslpy==3.29.1 transformations==2026.1.18
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import contextlib
import importlib.metadata as meta
import io
import sys

import numpy as np
import pynibs.expio

rng = np.random.default_rng(1)
intensity = np.repeat(np.arange(40.0, 80, 2), 3)  # % of the output
mep_mv = 2 / (1 + np.exp(-0.3 * (intensity - 60))) + rng.normal(0, 0.02, intensity.size)
seen = {}
for lowest in (40, 56, 60):
    there = intensity >= lowest
    curve = pynibs.expio.Mep(intensity[there], mep_mv[there])
    with contextlib.redirect_stdout(io.StringIO()):
        curve.fit_mep_to_function(p0=[60, 0.3, 2])
    middle, slope, height = curve.popt
    crossing = middle - np.log(height / 0.05 - 1) / slope
    seen[lowest] = (curve.fun.__name__, round(float(crossing)), round(float(curve.mt)))
    print(f"from {lowest} % on: the fitted {seen[lowest][0]} is at 50 uV at {crossing:.1f} %; pynibs's threshold {curve.mt:.1f} %")
print("pynibs", meta.version("pynibs"), "lmfit", meta.version("lmfit"), "numpy", meta.version("numpy"))
still = [one[2] for one in seen.values()] == [48, 56, 60] and all(one[0] == "sigmoid" and 45 < one[1] < 50 for one in seen.values())
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
