#!/usr/bin/env bash
# magicpy sends the trigger-in delay, in the wrong unit, in the place of the trigger-out delay.
#
# Expected: docstring of settrig_chargedelay: trig_out_delay is the "trigger-out delay in ms". In the MAGIC toolbox, of
#   which this is the translation, the frame holds both delays in tenths of a millisecond, negative ones in two's
#   complement.
# Seen: a trigger-out delay of zero or more is never sent: its place holds trig_in_delay without the factor of ten.
#   Asked for 0 ms in and 50 ms out it sends 0 and 0; for 100 ms in and 0 ms out it sends 100 and 10. Negative delays
#   are sent, one tenth of a millisecond too early.
# Hurts: the trigger output starts the EMG or the second stimulator. A pair that should be 50 ms apart is given at once,
#   or a sweep starts 10 ms late, and the call succeeds.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check magicpy==0.1.6 pyserial==3.5 pyparallel==0.2.2 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import importlib.metadata as meta
import sys

import magicpy
import serial

stimulator = magicpy.MagVenture("unused")
stimulator.port = serial.serial_for_url("loop://", timeout=1)
seen = {}
for trigger_in, trigger_out in ((0, 50), (100, 0), (5, 50), (0, -50)):
    stimulator.settrig_chargedelay(trigger_in, trigger_out, charge_delay=0)
    frame = stimulator.port.read(13)
    delays = tuple(int.from_bytes(frame[place : place + 2], "big", signed=True) / 10 for place in (3, 5))
    seen[trigger_in, trigger_out] = delays
    print(f"asked for {trigger_in} and {trigger_out} ms; sent {frame.hex(' ')}: {delays[0]} and {delays[1]} ms")
print("magicpy", meta.version("magicpy"))
still = seen == {(0, 50): (0, 0), (100, 0): (100, 10), (5, 50): (5, 0.5), (0, -50): (0, -50.1)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
