#!/usr/bin/env bash
# eegtopo takes a channel that was rejected in one condition for a power of zero there: its whole value becomes the effect.
#
# Expected: docstring of build_difference_matrix: the differences of two conditions by subject and channel for the cluster test. A
#   channel that a person lacks in one condition has no difference.
# Seen: missing values are filled with 0 before the subtraction: 12 uV² in one condition and none in the other is a
#   difference of 12, where the others have about 0. Two of ten persons are enough for a t of -1.65 instead of -0.93 at
#   this channel; if both conditions lack it, the difference is exactly 0. Nothing is said.
# Hurts: most recordings have bad channels, more of them in one condition (after stimulation, say): clusters of
#   artefacts.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2 mne==1.13.2
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps eegtopo==0.1.1
cd "$tmp"
MPLBACKEND=agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from eegtopo import TopographicAnalysis

CHANNELS = ["F3", "Fz", "F4", "C3", "Cz", "C4", "P3", "Pz", "P4"]
REJECTED = {("P01", "C3", "post"), ("P02", "C3", "post")}
rng = np.random.default_rng(1)
rows = [
    {"subject": subject, "channel": channel, "condition": condition, "value": 12 + rng.normal(0, 0.5)}
    for subject in (f"P{number:02d}" for number in range(1, 11))
    for channel in CHANNELS
    for condition in ("pre", "post")
    if (subject, channel, condition) not in REJECTED
]
analysis = TopographicAnalysis(pd.DataFrame(rows), montage_name="standard_1020")
differences, subjects = analysis.build_difference_matrix("post", "pre")
c3 = differences[:, analysis.ordered_channels.index("C3")]
seen = dict(zip(subjects, c3))
present = np.array([value for subject, value in seen.items() if subject not in ("P01", "P02")])
t_all, t_present = (float(one.mean() / (one.std(ddof=1) / np.sqrt(one.size))) for one in (c3, present))
print("post - pre at C3:", {subject: round(float(value), 1) for subject, value in seen.items()})
print(f"t at C3 {t_all:.2f}, of the persons who have it in both conditions {t_present:.2f}")
print("eegtopo", meta.version("eegtopo"))
still = all(abs(seen[subject] + 12) < 2 for subject in ("P01", "P02")) and abs(present).max() < 2 and abs(t_all) > 1.2
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
