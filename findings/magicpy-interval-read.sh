#!/usr/bin/env bash
# magicpy reads a MagVenture stimulator's interval of 1.0 to 1.4 ms as 1000 to 1400 ms, and fails on 1.5 ms.
#
# Expected: the stimulator states the place of the interval in its list, in two bytes; in Twin and Dual mode place 260
#   is 1 ms (magicpy's own table, and that of the MAGIC toolbox), and 260 is 0x0104. A frame's length is its second
#   byte, so its bytes may have any value.
# Seen: the two bytes are joined as hexadecimal text without a leading zero, so that 0x01 0x04 becomes 0x14, place 20:
#   1000 ms. Of the 261 places, 256 to 260 are read 1000 times too large. Answers are cut at each byte of 255, which is
#   what place 255 (1.5 ms) holds: IndexError; so does an answer whose checksum is 255 (here that of 9.2 ms).
# Hurts: 1 ms is an interval of short-interval intracortical inhibition. A script that logs, or checks before it fires,
#   the interval that get_ipi states has one second.
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

LIST = [(0, 3000, 100), (20, 1000, 50), (30, 500, 10), (70, 100, 1), (150, 20, 0.5), (170, 10, 0.1)]  # first place, ms, step


def interval_ms(place):
    first, start, step = [row for row in LIST if row[0] <= place][-1]
    return round(start - (place - first) * step, 1)


stimulator = magicpy.MagVenture("unused", flush_before_cmd=False, wait_s=0)
stimulator.port = port = serial.serial_for_url("loop://", timeout=1)
send, wrong = port.write, {}
for place in range(261):
    body = [9, 0, 0, 2, 0, 1, 3, place % 256, place // 256, 80]  # Twin, normal current, biphasic, two pulses, A to B 1
    check = int(stimulator.calc_crc([f"{byte:02x}" for byte in body]), 16)
    port.write = lambda _, body=body, check=check: send(bytes([0xFE, len(body), *body, check, 0xFF]))
    try:
        stated = stimulator.get_ipi()[0]
    except IndexError:
        stated = "IndexError"
    if stated == "IndexError" or abs(stated - interval_ms(place)) > 1e-9:
        wrong[interval_ms(place)] = stated
    port.reset_input_buffer()
for true, stated in wrong.items():
    print(f"interval of {true} ms: get_ipi says {stated}")
print("magicpy", meta.version("magicpy"))
still = {1.4: 1400, 1.3: 1300, 1.2: 1200, 1.1: 1100, 1.0: 1000, 1.5: "IndexError", 9.2: "IndexError"} == wrong
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
