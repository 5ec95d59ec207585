#!/usr/bin/env bash
# vcgsuite's logarithm of the respiratory power is of seconds squared, not of ms squared: it is 13.8 too small, and negative.
#
# Expected: docstring of compute_rsa_hf_power: the respiratory sinus arrhythmia as ln of the power in ms squared, comparable with
#   norms, of the same table as compute_rsa_amplitude, which is in ms.
# Seen: intervals are in s; the amplitude is multiplied by 1000, the power is not. A rhythm of 50 ms at 0.25 Hz has an amplitude of
#   55 ms and -6.8 in place of 7.1, which is a millionth of the power.
# Hurts: everyone who looks a value up in norms, where healthy adults have about 4 to 8.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1 pandas==2.3.3 pywavelets==1.8.0 \
    matplotlib==3.10.8 scikit-learn==1.5.2 joblib==1.6.0 tqdm==4.70.1 statsmodels==0.14.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps meegkit==0.1.9 pyriemann==0.7 pymanopt==2.2.1 vcgsuite==0.1.0
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import pandas as pd
from vcgsuite.hrv import compute_rsa_amplitude, compute_rsa_hf_power

intervals = 1.0 + 0.05 * np.sin(2 * np.pi * 0.25 * np.arange(300) + 0.3)  # s
table = pd.DataFrame({"Time": np.cumsum(intervals), "RR_interval": intervals})
amplitude = compute_rsa_amplitude(table, 0.25)
power = compute_rsa_hf_power(table, 0.25)
right = np.log(50**2 / 2)
print(f"a rhythm of 50 ms: amplitude {amplitude:.1f} ms, ln power {power:.2f}, by the definition {right:.2f}")
print(f"with ln(1000 squared) added: {power + np.log(1e6):.2f}")
print("vcgsuite", meta.version("vcgsuite"))
still = 45 < amplitude < 60 and power < 0 and abs(power + np.log(1e6) - right) < 0.2
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
