#!/usr/bin/env bash
# magpy says that a Magstim is armed whenever it is connected.
#
# Expected: docstring of isArmed: "returns True if the Magstim is armed or ready, False if not". The stimulator's status
#   byte has a bit each for standby, armed, ready and remote control, and magpy's own parser names them so.
# Seen: isArmed looks at the bits "armed" and "remote control". To ask is to take remote control, so that the answer is
#   True in standby, after disarm(), and so also when the stimulator disarms itself (after a minute without a pulse,
#   says arm()).
# Hurts: scripts that wait for isArmed() before a pulse, or look at it before a hand goes to the coil. Pulses are
#   counted and logged that the stimulator never gave; and "not armed" is never stated.
# A thread at the other end of a pseudo-terminal answers as a 200² does.
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

STANDBY, READY, COIL, REMOTE = 1, 4, 8, 128
multiprocessing.set_start_method("fork")
serial.Serial._update_rts_state = lambda port: None  # a pseudo-terminal has no such line
near, far = pty.openpty()
tty.setraw(near)
tty.setraw(far)
armed = False


def answer():
    global armed
    while True:
        command = os.read(near, 1)
        command += os.read(near, 1) + os.read(near, 1)  # the third byte is the check
        if command[:2] in (b"EA", b"EB"):
            armed = command[:2] == b"EB"
        reply = command[:1] + bytes([(READY if armed else STANDBY) | COIL | REMOTE])
        os.write(near, reply + bytes([~sum(reply) & 0xFF]))


threading.Thread(target=answer, daemon=True).start()
stimulator = magstim.Magstim(os.ttyname(far))
stimulator.connect()
says = {}
for state, act in (("after connect", None), ("after arm", stimulator.arm), ("after disarm", stimulator.disarm)):
    if act:
        act(receipt=True)
    instrument = stimulator.remoteControl(True, receipt=True)[1]["instr"]
    says[state] = (stimulator.isArmed(), instrument["armed"] or instrument["ready"])
    bits = [bit for bit in ("standby", "armed", "ready", "remoteStatus") if instrument[bit]]
    print(f"{state}: bits set {bits}, isArmed() is {says[state][0]}, isReadyToFire() is {stimulator.isReadyToFire()}")
stimulator.disconnect()
print("MagPy_TMS", meta.version("MagPy-TMS"))
still = says == {"after connect": (True, 0), "after arm": (True, 1), "after disarm": (True, 0)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
