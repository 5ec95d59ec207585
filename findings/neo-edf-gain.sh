#!/usr/bin/env bash
# neo's scale of EDF channels is too small: a TTL line stored as 0 and 1 for 0 and 5 V is read as 0 and 2.5 V.
#
# Expected: EDF specification, header: digital minimum and maximum are the stored values that correspond to the physical
#   minimum and maximum, so the gain is (physical maximum - minimum) / (digital maximum - minimum).
# Seen: neo divides by the number of steps plus one. The physical minimum is right, the maximum is never reached; the
#   error is 1/65536 of the range for 16 bits, 1/4096 for 12 bits, 1/256 for 8 bits, and one half for a line of one bit.
# Hurts: markers and force recorded with few bits: a threshold at half of the TTL's height finds no pulse; zero of a
#   symmetric EMG range is off by half a step.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check neo==0.14.6 edfio==0.4.18 pyedflib==0.1.42 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import edfio
import neo
import numpy as np
import pyedflib

volts = np.zeros(3000)
volts[1000:1010] = 5.0
still = True
for bits in (1, 8, 12):
    line = edfio.EdfSignal(
        volts, 1000, label="TTL", physical_dimension="V", physical_range=(0, 5), digital_range=(0, 2**bits - 1)
    )
    edfio.Edf([line]).write("ttl.edf")
    with pyedflib.EdfReader("ttl.edf") as reader:
        edflib = float(reader.readSignal(0).max())
    signal = neo.io.EDFIO("ttl.edf").read_block().segments[0].analogsignals[0]
    got = float(signal.rescale("V").magnitude.max())
    own = float(edfio.read_edf("ttl.edf").signals[0].data.max())
    print(f"{bits:2d} bits: edfio {own:.4f} V, pyedflib {edflib:.4f} V, neo {got:.4f} V")
    still = still and np.isclose(own, 5) and np.isclose(edflib, 5) and np.isclose(got, 5 - 5 / 2**bits)
print("neo", meta.version("neo"), "edfio", meta.version("edfio"), "pyedflib", meta.version("pyedflib"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
