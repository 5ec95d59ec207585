#!/usr/bin/env bash
# goppy's derivative of the likelihood by the length scale is doubled, or that of another kernel.
#
# Expected: documentation of OnlineGP.calc_log_likelihood: 'derivative' holds the partial derivatives of the log likelihood for
#   each parameter of the kernel; of the kernels: all have the complete functionality. They equal differences of 'value'.
# Seen: with the squared exponential kernel the derivative by the length scale is twice as large (1.86 for 0.93). With the
#   Matern 5/2 kernel both derivatives use the square root of 3 that belongs to Matern 3/2, and another polynomial: 3.03 for
#   2.17, -1.76 for -2.24. Those of Matern 3/2 and of the exponential kernel are right.
# Hurts: a fit by gradients ends beside the maximum, or its line search fails; with Matern 5/2 the derivative is not zero
#   at the best parameters.
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
from goppy import ExponentialKernel, Matern32Kernel, Matern52Kernel, OnlineGP, SquaredExponentialKernel

rng = np.random.default_rng(1)
x = rng.uniform(0, 10, (15, 1))
y = np.sin(x) + 0.1 * rng.normal(size=x.shape)


def likelihood(kernel, length, variance):
    process = OnlineGP(kernel([length], variance), noise_var=0.01)
    process.fit(x, y)
    return process.calc_log_likelihood(("value", "derivative"))


step, seen = 1e-5, {}
for kernel in (SquaredExponentialKernel, Matern52Kernel, Matern32Kernel, ExponentialKernel):
    stated = likelihood(kernel, 1.5, 1.0)["derivative"]
    by_differences = [
        float(likelihood(kernel, 1.5 + a, 1 + b)["value"] - likelihood(kernel, 1.5 - a, 1 - b)["value"]) / (2 * step)
        for a, b in ((step, 0), (0, step))
    ]
    seen[kernel.__name__] = [round(float(one) / other, 2) for one, other in zip(stated, by_differences)]
    print(f"{kernel.__name__}: stated {stated.round(2)}, by differences {np.round(by_differences, 2)} (length, variance)")
print("goppy", meta.version("goppy"))
still = seen == {
    "SquaredExponentialKernel": [2.0, 1.0],
    "Matern52Kernel": [1.4, 0.78],
    "Matern32Kernel": [1.0, 1.0],
    "ExponentialKernel": [1.0, 1.0],
}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
