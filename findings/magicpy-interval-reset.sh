#!/usr/bin/env bash
# magicpy sets a MagVenture stimulator's interval between two pulses to 100 ms whenever another setting is changed.
#
# Expected: docstrings of set_waveform, set_burst and set_baratio: what is not given "is read from the stimulator"; the
#   example of set_waveform says that all other settings are left as they are. README: set_current_dir('Reversed')
#   alone.
# Seen: with a stimulator in Twin mode at 25 ms (get_ipi says 25), set_current_dir, set_waveform, set_burst and
#   set_baratio each read the interval, drop it and send 100 ms. Nothing is raised or warned.
# Hurts: turning the coil's current between two blocks of paired pulses makes all later pairs 100 ms apart, at which
#   there is neither the inhibition nor the facilitation that was to be measured; it is seen only on the stimulator's
#   screen.
# A thread at the other end of a pseudo-terminal answers as the stimulator does (layout of the frames: magventure.m of
# the MAGIC toolbox, of which magicpy is the translation).
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check magicpy==0.1.6 pyserial==3.5 pyparallel==0.2.2 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import importlib.metadata as meta
import os
import pty
import sys
import threading
import tty

import magicpy

INTERVAL_INDEX = 145  # 100 - (145 - 70) = 25 ms in Twin mode
STATUS = [0, 0b10000110, 0, 0, 1, 25, 62, 50, 50]  # MagPro, enabled, biphasic, Twin
SETTINGS = [9, 0, 0, 2, 0, 1, 3, INTERVAL_INDEX, 0, 80]  # Twin, normal current, biphasic, two pulses, A to B 1
near, far = pty.openpty()
tty.setraw(near)
tty.setraw(far)
sent = []


def answer():
    held = b""
    while True:
        held += os.read(near, 64)
        while len(held) > 1 and len(held) >= held[1] + 4:
            frame, held = held[: held[1] + 4], held[held[1] + 4 :]
            body = frame[2:-2]
            if body[0] == 9 and body[1] == 1:
                sent.append(int.from_bytes(body[7:9], "big") / 10)  # tenths of a millisecond
            reply = STATUS if body[0] == 0 else SETTINGS
            check = int(magicpy.MagVenture.calc_crc([f"{byte:02x}" for byte in reply]), 16)
            os.write(near, bytes([0xFE, len(reply), *reply, check, 0xFF]))


threading.Thread(target=answer, daemon=True).start()
stimulator = magicpy.MagVenture(os.ttyname(far), wait_s=0.05, wait_l=0.05)
stimulator.connect()
print("interval that the stimulator states:", stimulator.get_ipi()[0], "ms")
for name, value in (("set_current_dir", "Reversed"), ("set_waveform", "Biphasic"), ("set_burst", 2), ("set_baratio", 1)):
    getattr(stimulator, name)(value, get_response=True)
    print(f"{name}({value!r}) sends an interval of {sent[-1]} ms")
print("magicpy", meta.version("magicpy"))
still = sent == [100.0] * 4
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
