#!/usr/bin/env bash
# pypalamedes's standard errors for a uniform prior are too small, by 58 in its default grid.
#
# Expected: docstring of ampm.setup_pm: se_a is the standard deviation of the threshold in the posterior, se_b that of the slope.
#   The entries with uniform_prior leave out the user's prior and take a uniform one instead. If the prior is uniform,
#   as it is unless another is given, both are the same numbers, one for each trial.
# Seen: the estimates themselves agree; the standard errors for the uniform prior are smaller by the square root of the
#   number of grid points (81 thresholds times 41 slopes: 57.6). That of the threshold has the other kind's numbers
#   but for the last trial, and one number too many after each trial but the first. Nothing is raised or warned.
# Hurts: thresholds that are reported with these errors, or a session that stops once they are small: it stops after the first
#   trials.
# (Its dependencies are named here, since it also asks for pathlib and importlib of PyPI, which are older than Python's own.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pypalamedes==1.11.13
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pypalamedes.ampm as ampm

rng = np.random.default_rng(1)
session = ampm.setup_pm()  # the prior is uniform
for _ in range(30):
    chance = 0.5 + 0.48 * (1 - np.exp(-(10 ** (2 * float(np.ravel(session["x_current"])[0])))))
    session = ampm.update_pm(session, int(rng.random() < chance))
kept = session["summ_stats"]
points = session["prior"].size
ratio = {}
for of, name in (("a", "threshold"), ("b", "log slope")):
    plain, uniform = kept[f"se_{of}"], kept[f"se_{of}_uniform_prior"]
    ratio[of] = float(plain[-1] / uniform[-1])
    print(
        f"{name}: {kept[of][-1]:.3f} ± {plain[-1]:.4f}, for a uniform prior "
        f"{kept[f'{of}_uniform_prior'][-1]:.3f} ± {uniform[-1]:.4f} (ratio {ratio[of]:.1f}); "
        f"{len(plain)} and {len(uniform)} numbers for 30 trials"
    )
print(f"square root of {points} grid points: {np.sqrt(points):.1f}")
same = np.allclose([kept["a"][-1], kept["b"][-1]], [kept["a_uniform_prior"][-1], kept["b_uniform_prior"][-1]])
print("pypalamedes", meta.version("pypalamedes"), "numpy", meta.version("numpy"))
still = same and np.allclose(list(ratio.values()), np.sqrt(points))
still = still and np.allclose(kept["se_a_uniform_prior"][:-1], kept["se_a"])
still = still and [len(kept[f"se_{of}_uniform_prior"]) for of in "ab"] == [31, 30]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
