#!/usr/bin/env bash
# bioread reads events that lie before time zero of an AcqKnowledge file as billions of samples after it.
#
# Expected: an event may lie before time zero (AcqKnowledge lets the time axis start anywhere), and its sample is a
#   signed number, as it is in bioread's own structure of the same field for files of versions before 4.
# Seen: for files of version 4 and later bioread takes the field for uint32. One of the recordings that bioread publishes
#   for its own tests (physio-5.0.1-c.acq, compressed, in its source package) has seven such events: its first event is
#   at 4,294,932,992 (68 years at 2 kHz in 123,787 samples); as int32 it is at -34,304. The same session saved
#   uncompressed (physio-5.0.1.acq) has it at 0, and all intervals between events agree once the sign is kept.
# Hurts: markers of TMS pulses in .acq files are lost or refused as outside of the recording.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check bioread==2025.5.2 numpy==2.4.6
"$tmp/venv/bin/pip" download -q --disable-pip-version-check --no-deps --no-binary bioread -d "$tmp" bioread==2025.5.2
cd "$tmp"
tar xzf bioread-2025.5.2.tar.gz
"$tmp/venv/bin/python" - <<'PY'
import importlib.metadata as meta
import sys

import bioread
import numpy as np

folder = "bioread-2025.5.2/test/data/physio/"
packed = bioread.read(folder + "physio-5.0.1-c.acq")
plain = bioread.read(folder + "physio-5.0.1.acq")
got = np.array([event.sample_index for event in packed.event_markers], dtype=np.int64)
true = np.array([event.sample_index for event in plain.event_markers], dtype=np.int64)
signed = got.astype(np.uint32).astype(np.int32).astype(np.int64)
print("samples of the longest channel:", max(channel.point_count for channel in packed.channels))
print("uncompressed:       ", true)
print("compressed:         ", got)
print("compressed as int32:", signed)
print("bioread", meta.version("bioread"))
shift = np.unique(signed - true)
print("signed minus uncompressed:", shift)
still = int((got > 2**31).sum()) == 7 and shift.tolist() == [-34304]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
