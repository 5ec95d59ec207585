#!/usr/bin/env bash
# wfdb drops notes that lie on the first sample of a record.
#
# Expected: WFDB Applications Guide, annotation files: an annotation has a time in samples from 0, and a NOTE (written
#   as the symbol '"') may carry any text. What wrann wrote, rdann gives back.
# Seen: rdann takes every note of sample 0 for its own line that states the time resolution, whatever its text, and
#   leaves it out. Other symbols of sample 0, and notes of all other samples, stay. No warning.
# Hurts: records cut at the pulse (one sweep a record, the usual form of triggered EMG) have their stimulus note exactly at
#   sample 0: the label that says which condition the sweep was is gone.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check wfdb==4.3.1 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import wfdb


def round_trip(samples, symbols, notes):
    wfdb.wrann("sweep", "atr", np.array(samples), symbol=symbols, aux_note=notes, fs=5000)
    read = wfdb.rdann("sweep", "atr")
    return list(zip(read.sample.tolist(), read.symbol, read.aux_note))


first = round_trip([0, 125, 400], ['"', '"', '"'], ["TMS, pair of 25 ms", "MEP onset", "MEP end"])
later = round_trip([1, 125, 400], ['"', '"', '"'], ["TMS, pair of 25 ms", "MEP onset", "MEP end"])
other = round_trip([0, 125, 400], ["N", "N", "N"], ["TMS, pair of 25 ms", "MEP onset", "MEP end"])
for name, value in (("notes from sample 0", first), ("notes from sample 1", later), ("symbol N from 0", other)):
    print(f"{name}: {len(value)} of 3 read back: {value}")
print("wfdb", meta.version("wfdb"))
still = [row[0] for row in first] == [125, 400] and len(later) == 3 and len(other) == 3
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
