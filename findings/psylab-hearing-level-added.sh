#!/usr/bin/env bash
# psylab adds the threshold of hearing where it should subtract it: a normal threshold at 125 Hz is a loss of 90 dB.
#
# Expected: dB HL is relative to the normal threshold of each frequency (ANSI S3.6; the table in psylab is that of its
#   reference levels, 45 dB SPL at 125 Hz): HL is SPL minus the reference, a person who just hears the reference has 0 dB
#   HL.
# Seen: spl2hl adds it, hl2spl subtracts it. 45 dB SPL at 125 Hz are stated as 90 dB HL, and 40 dB HL are presented at -5 dB
#   SPL: inaudible. Both are wrong by twice the reference, 15 dB at 1 kHz.
# Hurts: hearing thresholds of an experiment are reported far too high, or stimuli at a level in HL are too soft by 15 to 90
#   dB; the round trip is right, so that a test of it passes.
# (Only this module is loaded: others need a scipy of 2022.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps psylab==1.0.7
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

root = meta.distribution("psylab").locate_file("psylab")
for name in ("psylab", "psylab.signal"):
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__path__ = [str(root.joinpath(*name.split(".")[1:]))]
from psylab.signal.level import hl2spl, hl_conversion, spl2hl

seen = {}
for frequency in (125, 1000, 4000):
    normal = hl_conversion[frequency]  # dB SPL that a normal ear just hears
    seen[frequency] = (spl2hl(normal, frequency), hl2spl(0, frequency))
    print(f"{frequency} Hz, {normal:g} dB SPL just heard: 0 dB HL, psylab {seen[frequency][0]:g}; 0 dB HL back: psylab {seen[frequency][1]:g} dB SPL")
print("psylab", meta.version("psylab"))
still = seen == {125: (90.0, -45.0), 1000: (15.0, -7.5), 4000: (24.0, -12.0)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
