#!/usr/bin/env bash
# pynwb's trials refer to the EMG one sample too early, or have one sample too many, when a time in decimals meets a
# rate.
#
# Expected: NWB schema, TimeIntervals: the column timeseries holds for each interval the start and the number of samples
#   of a TimeSeries. A trial that starts on a sample starts with that sample, and trials of 100 ms at 5 kHz have 500.
# Seen: add_trial(timeseries=...) multiplies in floating point and cuts: a product just below a whole number loses one.
#   Of 1000 pulses that lie on a sample each, 67 begin one sample early and more have 499 or 501 samples; np.stack of
#   the sweeps fails, and a table that is padded or cut to fit has the pulse in different columns.
# Hurts: the pulse is expected at a fixed sample of each sweep; artefact blanking and latencies are one sample off in a
#   few trials of each session, and averages are blurred.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check pynwb==4.2.0 hdmf==6.2.0 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import collections
import datetime as dt
import importlib.metadata as meta
import sys

import numpy as np
import pynwb

RATE, SAMPLES = 5000, 500
pulses = np.arange(1000) * 5 * 1234 + 41000  # samples: every 1.234 s from 8.2 s
emg = np.zeros(pulses[-1] + RATE)
emg[pulses] = 1.0
nwb = pynwb.NWBFile("a session", "trials", dt.datetime(2026, 1, 1, tzinfo=dt.timezone.utc))
series = pynwb.TimeSeries(name="emg", data=emg, unit="volts", rate=float(RATE))
nwb.add_acquisition(series)
for pulse in pulses:
    start = round(pulse / RATE, 4)
    nwb.add_trial(start_time=start, stop_time=round(start + SAMPLES / RATE, 4), timeseries=[series])
references = [row[0] for row in nwb.trials["timeseries"][:]]
early = collections.Counter(int(r.idx_start - pulse) for r, pulse in zip(references, pulses))
lengths = collections.Counter(int(r.count) for r in references)
first = [r.idx_start == pulse for r, pulse in zip(references, pulses)].index(False)
start = float(nwb.trials["start_time"][first])
print(f"trial {first} starts at {start} s: sample {references[first].idx_start} instead of {pulses[first]} ({start * RATE!r})")
print("start minus the pulse's sample, trials:", dict(early))
print("samples of a trial, trials:            ", dict(lengths))
print("pynwb", meta.version("pynwb"))
still = set(early) == {0, -1} and set(lengths) >= {499, 500} and early[-1] > 5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
