#!/usr/bin/env bash
# scikit-posthocs returns what is left after its ESD test in order of size: trials lose their order.
#
# Expected: docstring of outliers_gesd: "returns the filtered array with outliers removed"; with hypo=True a mask of the
#   outliers. The two agree: the filtered array is the data at the mask's other places, as with outliers_iqr.
# Seen: the filtered array is sorted. Its length is right, and so is the mask; where nothing is an outlier the data come
#   back sorted, too.
# Hurts: MEPs cleaned this way and laid beside their trials (time, intensity, interval): the amplitude grows with the
#   trial in any session, a strong trend that is not there.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    scikit-posthocs==0.17.1 numpy==2.4.6 pandas==3.1.1 scipy==1.17.1 statsmodels==0.15.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import scikit_posthocs as posthocs

mep_mv = np.array([9.0, 1.0, 1.1, 0.9, 1.05, 1.2, 8.0, 0.97, 1.01, 0.95, 1.15, 1.02])
mask = posthocs.outliers_gesd(mep_mv, hypo=True)
left = posthocs.outliers_gesd(mep_mv)
clean = posthocs.outliers_gesd(mep_mv[~mask])
print("outliers by the mask:", mep_mv[mask])
print("what is left by the mask:", mep_mv[~mask])
print("by outliers_iqr:         ", posthocs.outliers_iqr(mep_mv))
print("by outliers_gesd:        ", left)
print("without outliers:        ", clean)
kept = mep_mv[~mask]
trend = [float(np.corrcoef(np.arange(len(one)), one)[0, 1]) for one in (kept, left)]
print(f"correlation with the trial: {trend[0]:.2f} in order, {trend[1]:.2f} as returned")
print("scikit-posthocs", meta.version("scikit-posthocs"))
still = mep_mv[mask].tolist() == [9, 8] and posthocs.outliers_iqr(mep_mv).tolist() == kept.tolist()
still = still and left.tolist() == clean.tolist() == sorted(kept) and trend[1] > 0.9 > abs(trend[0])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
