#!/usr/bin/env bash
# metricspace's correction of information for its bias (Treves and Panzeri) is zero by default; the information itself raises.
#
# Expected: its README: mutual information of a table by tblxinfo, its bias by tblxtpbi (Treves and Panzeri), to be added. With R
#   rows, C columns and n counts the correction is (R - 1 + C - 1 - (R C - 1)) / (2 n ln 2) bits.
# Seen: tblxinfo, and tblxbi with the jackknife, raise AttributeError, as a function has its module's name. In tblxtpbi with useall
#   0, the default, and 1 the number of bins is that of the rows of a reshaped table, always 1, and so the correction is 0. Only
#   useall=-1 is right.
# Hurts: what spike trains, or units of a decomposed EMG, tell of the stimulus: 80 trials of four stimuli without any relation
#   seem to tell 0.09 bits, also after the "correction"; fewer trials tell more.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 numba==0.68.1 pandas==3.1.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps metricspace==1.2.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import metricspace
import numpy as np


def information(counts):
    """The mutual information of a table of counts [bits], with its bias."""
    share = counts / counts.sum()
    apart = np.outer(share.sum(axis=1), share.sum(axis=0))
    return float(np.sum(share[share > 0] * np.log2(share[share > 0] / apart[share > 0])))


rng = np.random.default_rng(1)
seen = {}
for trials in (80, 400):
    rows = []
    for _ in range(200):
        table = np.zeros((4, 4), int)
        np.add.at(table, (rng.integers(0, 4, trials), rng.integers(0, 4, trials)), 1)  # no relation
        corrections = [float(metricspace.tblxtpbi(table, *useall)) for useall in ((), (1,), (-1,))]
        rows.append([information(table), *corrections])
    seen[trials] = *np.mean(rows, axis=0), (3 + 3 - 15) / (2 * trials * np.log(2))
    print(
        f"{trials} trials, no relation: {seen[trials][0]:.3f} bits; correction by default {seen[trials][1]:.3f}, "
        f"with useall=1 {seen[trials][2]:.3f}, with useall=-1 {seen[trials][3]:.3f}, by the formula {seen[trials][4]:.3f}"
    )
raised = []
for call in (lambda: metricspace.tblxinfo(table / table.sum()), lambda: metricspace.tblxbi(table, "ja")):
    try:
        call()
    except AttributeError as error:
        raised.append(type(error).__name__)
print("tblxinfo and tblxbi with the jackknife:", raised)
print("metricspace", meta.version("metricspace"))
still = all(one == two == 0 and abs(right - formula) < 0.01 for _, one, two, right, formula in seen.values()) and len(raised) == 2
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
