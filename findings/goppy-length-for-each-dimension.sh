#!/usr/bin/env bash
# goppy's length scales, one for each dimension, are applied to the points: with as many points as dimensions silently.
#
# Expected: documentation of each kernel: lengthscales is an array with the length scale of each dimension. Two dimensions
#   with length scales 1 and 5: a step of 1 along the second changes less than one along the first; the covariance
#   is symmetric.
# Seen: the distance of two points in all dimensions is divided by the length scale that has the number of the second point. Three
#   points in two dimensions raise ValueError; two points are accepted, and their covariance is 0.61 one way and
#   0.98 the other, for a step along either dimension.
# Hurts: designs over two settings, such as interval and intensity, cannot have a length scale for each; a first fit to two
#   points gives a prediction for no length scale at all.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check goppy==1.1.2 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from goppy import ExponentialKernel, Matern32Kernel, Matern52Kernel, SquaredExponentialKernel

kernel = SquaredExponentialKernel([1.0, 5.0])
first = kernel(np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[0.0, 0.0], [1.0, 0.0]]))
second = kernel(np.array([[0.0, 0.0], [0.0, 1.0]]), np.array([[0.0, 0.0], [0.0, 1.0]]))
print("a step of 1 along the first dimension (length scale 1):", first.round(2).tolist())
print("a step of 1 along the second dimension (length scale 5):", second.round(2).tolist())
raised = []
for one in (SquaredExponentialKernel, ExponentialKernel, Matern32Kernel, Matern52Kernel):
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    try:
        one([1.0, 5.0])(points, points)
    except ValueError as error:
        raised.append(one.__name__)
        print(f"three points, {one.__name__}: ValueError: {error}")
print("goppy", meta.version("goppy"))
still = (
    first.round(2).tolist() == [[1.0, 0.98], [0.61, 1.0]]
    and second.round(2).tolist() == first.round(2).tolist()
    and len(raised) == 4
)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
