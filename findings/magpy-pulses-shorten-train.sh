#!/usr/bin/env bash
# magpy's setNPulses makes a Rapid²'s train ten times too short.
#
# Expected: docstring of Rapid.setNPulses: changing the number of pulses updates the duration by the frequency. README:
#   the stimulator takes durations in tenths of a second, and from version 1.2 on magpy's callers state them in seconds.
# Seen: setNPulses sends the seconds as tenths, cut to a whole number. 100 pulses at 10 Hz set 1.0 s instead of 10 s; 5
#   pulses at 10 Hz set 0, which is what rTMSMode(False) sends to leave repetitive mode. It reports success;
#   setDuration(10) is right.
# Hurts: a train ends after a tenth of its time, or is one pulse. What was asked for (100 pulses) is what the script
#   logs.
# A thread at the other end of a pseudo-terminal answers as a Rapid² of software 9 does, as far as magpy asks.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check MagPy-TMS==1.4 pyserial==3.5 pyyaml==6.0.4
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import multiprocessing
import os
import pty
import sys
import threading
import tty

import serial
from magpy import magstim

DIGITS = {b"B": 4, b"D": 5, b"[": 4, b"@": 3}  # frequency, pulses, duration, power; other commands have one byte
multiprocessing.set_start_method("fork")
serial.Serial._update_rts_state = lambda port: None  # a pseudo-terminal has no such line
near, far = pty.openpty()
tty.setraw(near)
tty.setraw(far)
held = {b"@": 30, b"B": 100, b"D": 10, b"[": 10}  # 30 %, 10 Hz, 10 pulses, 1 s


def answer():
    while True:
        command = os.read(near, 1)
        data = b"".join(os.read(near, 1) for _ in range(DIGITS.get(command, 1)))
        os.read(near, 1)  # the check
        reply = command + bytes([1 | 8 | 128])
        if command in held:
            held[command] = int(data)
        if command in DIGITS or command == b"\\":
            reply += bytes([16 | 32])
        if command == b"\\":
            reply += b"%03d%04d%05d%04d%04d" % (held[b"@"], held[b"B"], held[b"D"], held[b"["], 5)
        if command == b"N":
            reply += b"9.0.0\x00"
        os.write(near, reply + bytes([~sum(reply) & 0xFF]))


threading.Thread(target=answer, daemon=True).start()
stimulator = magstim.Rapid(os.ttyname(far), unlockCode="")
stimulator.connect()
seen = {}
for pulses in (100, 25, 5):
    error, _ = stimulator.setNPulses(pulses, receipt=True)
    state = stimulator.getParameters()[1]["rapidParam"]
    seen[pulses] = (error, state["nPulses"], state["duration"])
    print(f"setNPulses({pulses}) at {state['frequency']} Hz: error {error}, {state['nPulses']} pulses "
          f"in {state['duration']} s instead of {pulses / state['frequency']} s")
stimulator.setDuration(10, receipt=True)
right = stimulator.getParameters()[1]["rapidParam"]
print(f"setDuration(10): {right['nPulses']} pulses in {right['duration']} s")
stimulator.disconnect()
print("MagPy_TMS", meta.version("MagPy-TMS"))
still = seen == {100: (0, 100, 1.0), 25: (0, 25, 0.2), 5: (0, 5, 0.0)}
still = still and (right["nPulses"], right["duration"]) == (100, 10.0)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
