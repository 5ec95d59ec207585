#!/usr/bin/env bash
# liesl's ring buffer empties its samples on reset but keeps their times: the next MEP is cut at the wrong place.
#
# Expected: docstring of RingBuffer.reset: the buffer is emptied and collects afresh; of get: the timestamps are those of
#   each sample, so there is one for each row, as before the reset.
# Seen: reset() empties the samples only. Until the buffer has filled up again get() returns more times than samples,
#   and the time in row n belongs to another sample than row n. Nothing is raised or warned.
# Hurts: a reset between two blocks: liesl's own Response finds the pulse by the times and cuts the samples there. For
#   the length of the buffer its MEPs are noise of some hundred milliseconds after the pulse, or it fails.
# The stream is one of this computer (Lab Streaming Layer over the loopback).
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    liesl==0.3.5.0 pylsl==1.18.6 pyxdf==1.17.5 numpy==2.4.6 setuptools==75.8.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - 2>/dev/null <<'PY'
import importlib.metadata as meta
import os
import sys
import time

import numpy as np
import pylsl
from liesl.buffers.response import Response
from liesl.buffers.ringbuffer import RingBuffer

RATE = 1000
name = f"emg-{os.getpid()}"
outlet = pylsl.StreamOutlet(pylsl.StreamInfo(name, "EMG", 1, RATE, "float32", name))


def send(samples):
    """Send samples at their rate, all at once, and wait until the buffer has them."""
    send.next += len(samples) / RATE
    outlet.push_chunk(samples.astype(np.float32)[:, None].tolist(), send.next - 1 / RATE)
    time.sleep(1)


send.next = pylsl.local_clock()
buffer = RingBuffer(pylsl.resolve_byprop("name", name, timeout=30)[0], duration_in_ms=2000)
buffer.await_running()
outlet.wait_for_consumers(10)
send(np.zeros(2000))
before = [len(part) for part in buffer.get()]
buffer.reset()
pulse = send.next + 0.5
mep = np.zeros(1500)
mep[522], mep[528] = 500, -500  # 22 and 28 ms after the pulse
send(mep)
samples, times = buffer.get()
onset = pulse + buffer.offset
amplitude = Response(samples, times, onset, fs=RATE).get_vpp()
right = Response(samples, times[-len(samples) :], onset, fs=RATE).get_vpp()
buffer.stop()
print(f"before the reset {before[0]} samples and {before[1]} times; after it {len(samples)} and {len(times)}")
print(f"MEP of 1000 uV: {amplitude:.0f} uV with the times as they are, {right:.0f} uV with the last {len(samples)} of them")
print("liesl", meta.version("liesl"), "pylsl", meta.version("pylsl"))
still = before == [2000, 2000] and (len(samples), len(times)) == (1500, 2000) and (amplitude, right) == (0, 1000)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
