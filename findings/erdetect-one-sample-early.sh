#!/usr/bin/env bash
# erdetect finds each evoked response one sample early.
#
# Expected: docstring of ieeg_detect_er: the first array of its result has the (sample) indices of the evoked responses in the
#   data that were given, the second their amplitudes. data[..., index] is the amplitude.
# Seen: the search begins at the sample after the one that is added to the result, so that each index is one too small: the
#   amplitude is right and is that of the next sample. 2 ms at 512 Hz, 0.5 ms at 2048 Hz.
# Hurts: latencies of early responses (N1 at 10 to 30 ms), the more the lower the rate; two systems at different
#   rates have different latencies for the same response.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    erdetect==2.6.2 ieegprep==1.6.1 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2 bids_validator==1.14.7.post0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from erdetect.core.detection import ieeg_detect_er

still = True
for rate in (512, 2048):
    onset = 2 * rate
    peak = onset + round(0.03 * rate)
    microvolts = np.random.default_rng(1).normal(0, 5, (1, 1, 4 * rate))
    microvolts[0, 0] -= 600 * np.exp(-(((np.arange(4 * rate) - peak) / (0.008 * rate)) ** 2))
    peak = onset + 5 + int(np.argmin(microvolts[0, 0, onset + 5 : onset + rate // 4]))
    indices, amplitudes = ieeg_detect_er(microvolts, onset, rate)
    found, amplitude = int(indices[0, 0]), float(amplitudes[0, 0])
    print(
        f"{rate} Hz: minimum of {microvolts[0, 0, peak]:.1f} uV at sample {peak}; found {amplitude:.1f} uV at {found}, "
        f"where {microvolts[0, 0, found]:.1f} uV are: {1000 * (peak - found) / rate:.1f} ms early"
    )
    still = still and found == peak - 1 and np.isclose(amplitude, microvolts[0, 0, peak])
print("erdetect", meta.version("erdetect"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
