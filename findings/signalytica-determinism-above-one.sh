#!/usr/bin/env bash
# signalytica's determinism is 4 for noise and 29 for a tone, where it is a share of at most 1: each diagonal is counted again and again.
#
# Expected: its list of features: "determinism" of a recurrence plot. Marwan et al., Phys. Rep. 438 (2007): the share of the recurrence
#   points that are in diagonal lines of at least l_min points, so from 0 to 1.
# Seen: a line is measured from each of its points, not only from its first: a line of 5 points counts 5 + 4 + 3 + 2. Determinism grows with
#   the length of the window and has no upper limit; the mean and the entropy of line lengths are those of such pieces, too.
# Hurts: recurrence analysis of EEG and EMG: no value can be compared with any in the literature, nor between windows of two lengths.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps signalytica==0.1.20
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from signalytica import SignaLytica


def right(signal, shortest=2):
    near = np.abs(signal[:, None] - signal[None]) < 0.2 * signal.std()
    lengths = []
    for offset in range(-len(signal) + 1, len(signal)):
        runs = "".join("x" if point else " " for point in np.diagonal(near, offset)).split()
        lengths += [len(run) for run in runs if len(run) >= shortest]
    return sum(lengths) / near.sum()


rng, seen = np.random.default_rng(1), {}
tone = 10 * np.sin(2 * np.pi * 10 * np.arange(256) / 128)
for name, signal in {"noise": rng.normal(size=256), "tone": tone, "half of the tone": tone[:128]}.items():
    seen[name] = (float(SignaLytica().determinism(signal)), float(right(signal)))
    print(f"{name}: determinism {seen[name][0]:.2f}, by definition {seen[name][1]:.2f}")
print("signalytica", meta.version("signalytica"))
still = all(value > 4 and share <= 1 for value, share in seen.values()) and seen["tone"][0] > 1.5 * seen["half of the tone"][0]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
