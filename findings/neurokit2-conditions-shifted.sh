#!/usr/bin/env bash
# neurokit2's events_find gives pulses the condition of another pulse as soon as it leaves one out.
#
# Expected: documentation of events_find: several digital channels are combined, "the higher the channel, the higher the
#   bit", and the value is each event's condition; duration_min, start_at, inter_min and discard_first say which events
#   are left out. An event that stays keeps its condition.
# Seen: onsets and durations are filtered, conditions are not, and the lists then have different lengths without a word.
#   With one spike of a sample left out by duration_min, the pulse after it takes the spike's condition, and so on to
#   the end. epochs_create goes on with them: three of four sweeps here have a condition that was not given.
# Hurts: single pulses, pairs and tests alone told apart by two trigger lines; one spike on a line, or the practice
#   trials cut off with start_at, and the comparison of conditions is between mixed sweeps.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check neurokit2==0.3.0 numpy==2.4.6 pandas==3.0.0 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import neurokit2 as nk
import numpy as np

given = {500: 1, 1000: 2, 2000: 3, 2500: 2}  # sample of each pulse, and its code on two lines
low, high = np.zeros(3000), np.zeros(3000)
for sample, code in given.items():
    low[sample : sample + 20] = code & 1
    high[sample : sample + 20] = code >> 1
clean = nk.events_find([low, high], duration_min=5)
low[1500] = 1  # a spike of one sample
spiked = nk.events_find([low, high], duration_min=5)
late = nk.events_find([low, high], duration_min=5, start_at=900)


def lists(events):
    return [int(onset) for onset in events["onset"]], [int(code) for code in events["condition"]]


for name, events in (("without the spike", clean), ("with the spike", spiked), ("from sample 900", late)):
    onsets, codes = lists(events)
    print(f"{name}: onsets {onsets}, conditions {codes}; given {[given[onset] for onset in onsets]}")
sweeps = nk.epochs_create(np.zeros(3000), spiked, sampling_rate=1000, epochs_start=0, epochs_end=0.2)
labels = {int(sweep["Index"].iloc[0]): int(sweep["Condition"].iloc[0]) for sweep in sweeps.values()}
print("conditions of the sweeps by epochs_create:", labels, "given:", given)
print("neurokit2", meta.version("neurokit2"))
still = lists(clean) == (list(given), list(given.values()))
still = still and lists(spiked) == (list(given), [1, 2, 1, 3, 2]) and len(late["condition"]) == 5 > len(late["onset"])
still = still and list(labels) == list(given) and labels != given
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
