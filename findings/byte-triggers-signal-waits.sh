#!/usr/bin/env bash
# byte-triggers' signal() returns when the pulse is over: a stimulus after it is late by the pulse's length.
#
# Expected: docstring of ParallelPortTrigger: delay is the time in milliseconds "until which a new trigger cannot be sent"; a
#   thread pool (so a comment of the code) resets the pins. signal() sets the pins and returns; a signal within the delay
#   is warned of and ignored.
# Seen: the reset is called instead of being handed to the pool: signal() sleeps for the delay, sets the pins to zero and
#   returns. A second signal at once is not ignored: it is sent one delay late.
# Hurts: a marker before a sound, picture or pulse is that much too early in the EMG (10 ms by default, more with
#   slow amplifiers), and two markers at once are apart by it; a loop that times stimuli loses it in each trial.
# A thread at the other end of a pseudo-terminal notes what comes (the Arduino to LPT converter takes one byte a state).
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    byte-triggers==0.4.1 mne-lsl==1.14.0 mne==1.13.2 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2 pyserial==3.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import os
import pty
import sys
import threading
import time
import tty

from byte_triggers import ParallelPortTrigger

DELAY_MS = 200
ours, theirs = pty.openpty()
tty.setraw(theirs)
pins = []


def note():
    while True:
        states = os.read(ours, 64)
        pins.extend((time.perf_counter(), state) for state in states)


threading.Thread(target=note, daemon=True).start()
trigger = ParallelPortTrigger(os.ttyname(theirs), port_type="arduino", delay=DELAY_MS)
time.sleep(0.2)
pins.clear()
start = time.perf_counter()
trigger.signal(5)
took_ms = 1000 * (time.perf_counter() - start)
trigger.signal(7)
time.sleep(0.2)
print(f"signal(5) with a delay of {DELAY_MS} ms returned after {took_ms:.0f} ms; then signal(7) at once")
print("pins:", [(f"{1000 * (at - start):.0f} ms", state) for at, state in pins])
print("byte-triggers", meta.version("byte_triggers"))
still = took_ms >= DELAY_MS and [state for _, state in pins] == [5, 0, 7, 0]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
