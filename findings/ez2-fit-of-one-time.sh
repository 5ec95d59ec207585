#!/usr/bin/env bash
# EZ2's maximum likelihood uses the first time of a list only, and of both boundaries not which was hit how often.
#
# Expected: help of ddexit_fit: maximum likelihood of drift rate, start and boundary. "If len(rt) = 2", rt has the times at both
#   boundaries; "otherwise rt is a list of exit times either at the top or bottom boundary". A likelihood of both holds how
#   often each was hit.
# Seen: of a list of 500 times rt[0], the first, is fitted: the result does not change with the other 499. With
#   both boundaries the density is that on condition of the boundary, which is the same for a drift of 0.1 and of -0.1: which
#   sign is found depends on the starting value.
# Hurts: estimates of one trial that look like those of all; a drift towards the wrong answer for a person who is mostly right.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==2.3.3 EZ2==0.0.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import EZ2
import numpy as np

TRUE = 0.1, 0.05, 0.12
np.random.seed(1)
top = EZ2.rddexit(500, *TRUE)
bottom = EZ2.rddexit(220, *TRUE, top_boundary=False)
start = [0.15, 0.06, 0.15]
all_times = EZ2.ddexit_fit(top, start).x
others_changed = EZ2.ddexit_fit(np.concatenate((top[:1], 3 * top[1:])), start).x
print(f"500 times at the top: {all_times.round(3)}; with all but the first three times as long: {others_changed.round(3)}")
rate = float(EZ2.pe(*TRUE))
fits = [EZ2.ddexit_fit([bottom, top], [sign * 0.12, 0.055, 0.13], method="Nelder-Mead") for sign in (1, -1)]
for fit in fits:
    print(f"both boundaries, {top.size} times the right one (rate {1 - rate:.2f}): drift {fit.x[0]:.3f}, criterion {fit.fun:.4f}")
print("EZ2", meta.version("EZ2"))
still = np.array_equal(all_times, others_changed) and not np.allclose(all_times, TRUE, rtol=0.5)
still &= bool(fits[0].x[0] > 0.03 and fits[1].x[0] < -0.03 and abs(fits[0].fun - fits[1].fun) < 1e-3)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
