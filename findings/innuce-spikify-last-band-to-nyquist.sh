#!/usr/bin/env bash
# innuce-spikify's filter bank ends at half the rate, not at f_max: noise above the highest frequency is in the last band.
#
# Expected: docstring of FilterBank: f_max is the highest frequency of the bank; its bands lie one beside the other from f_min to
#   f_max.
# Seen: the last band's upper end is overwritten by half the rate. Four bands from 20 to 450 Hz at 5 kHz end at 2500 Hz, and a tone
#   of 1500 Hz, three times f_max, passes with its whole amplitude.
# Hurts: EMG that is turned into spikes: the last channel holds mostly noise, and changes with the amplifier's rate.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps innuce-spikify==1.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from spikify.filters import FilterBank

seen = {}
time = np.arange(10_000)
for rate in (2000, 5000):
    bank = FilterBank(fs=rate, channels=4, f_min=20, f_max=450, order=2, filter_type="sos")
    tone = np.sin(2 * np.pi * 0.3 * time)  # 0.3 of the rate: 600 and 1500 Hz
    passed = bank.decompose(tone)[2000:, -1, 0].std() / tone.std()
    seen[rate] = (round(float(bank.channel_frequencies[-1][1])), round(float(passed), 2))
    print(f"{rate} Hz: the last band of 20 to 450 Hz ends at {seen[rate][0]} Hz; of {0.3 * rate:.0f} Hz it passes {seen[rate][1]:.2f}")
print("innuce-spikify", meta.version("innuce-spikify"))
still = [end for end, _ in seen.values()] == [1000, 2500] and min(passed for _, passed in seen.values()) > 0.9
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
