#!/usr/bin/env bash
# vcgsuite's default matrix from twelve leads to the vectorcardiogram has seven wrong signs: the heart's vector turns.
#
# Expected: docstring of ecg12_to_frank_xyz and comments: "IDT" is the inverse Dower matrix (Edenbrandt and Pahlm, 1988), the inverse
#   of Dower's matrix from X, Y and Z to the leads. Leads made by that from a vector give the vector back.
# Seen: I, V1, V3, V4 and V5 have the other sign in Y, V3 in X, V4 in Z (which points forwards here). A vector straight to the left
#   comes back as 0.78, 0.49, -0.15, so 32 degrees down; one to the back has 0.31 in X. KORS has six, among them V2 in X and II in Z.
# Hurts: QRS and T angles, loops and rotation of every 12-lead recording, by the default method.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.3.3 pywavelets==1.8.0 \
    matplotlib==3.10.8 scikit-learn==1.5.2 joblib==1.6.0 tqdm==4.70.1 statsmodels==0.14.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps meegkit==0.1.9 pyriemann==0.7 pymanopt==2.2.1 vcgsuite==0.1.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import contextlib
import importlib.metadata as meta
import io
import sys

import numpy as np
from vcgsuite.transform import MATRICES, ecg12_to_frank_xyz

leads = ("I", "II", "V1", "V2", "V3", "V4", "V5", "V6")
dower = np.array([  # from X, Y and Z to each lead; its pseudo-inverse is the inverse Dower matrix
    [0.632, -0.235, 0.059], [0.235, 1.066, -0.132], [-0.515, 0.157, -0.917], [0.044, 0.164, -1.387],
    [0.882, 0.098, -1.277], [1.213, 0.127, -0.601], [1.125, 0.127, -0.086], [0.831, 0.076, 0.230],
])  # fmt: skip
right = np.linalg.pinv(dower) * [[1], [1], [-1]]  # vcgsuite's Z points forwards
kors = np.array([  # Kors and others, 1990, Z forwards
    [0.38, -0.07, -0.13, 0.05, -0.01, 0.14, 0.06, 0.54], [-0.07, 0.93, 0.06, -0.02, -0.05, 0.06, -0.17, 0.13],
    [-0.11, 0.23, 0.43, 0.06, 0.14, 0.20, 0.11, -0.31],
])  # fmt: skip
wrong = {}
for name, matrix in (("IDT", right), ("KORS", kors)):
    turned = np.sign(MATRICES[name]) != np.sign(matrix)
    size = np.abs(np.abs(MATRICES[name]) - np.abs(matrix)).max()
    wrong[name] = [f"{leads[column]} in {'XYZ'[row]}" for row, column in np.argwhere(turned & (np.abs(matrix) > 0.005))]
    print(f"{name}: sizes differ by {size:.3f} at most; other signs: {', '.join(wrong[name])}")
vectors = []
for name, vector in (("left", (1, 0, 0)), ("down", (0, 1, 0)), ("back", (0, 0, 1))):
    with contextlib.redirect_stdout(io.StringIO()):
        found = ecg12_to_frank_xyz({lead: np.array([value]) for lead, value in zip(leads, dower @ vector)})
    vectors.append([float(one[0]) for one in found])
    print(f"a vector to the {name}: {np.round(vectors[-1], 2)}, by the inverse {np.round(right @ dower @ vector, 2)}")
print("vcgsuite", meta.version("vcgsuite"))
still = len(wrong["IDT"]) == 7 and len(wrong["KORS"]) >= 5 and vectors[0][1] > 0.45 and vectors[2][0] > 0.25
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
