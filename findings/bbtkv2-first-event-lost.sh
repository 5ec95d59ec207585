#!/usr/bin/env bash
# bbtkv2 loses the first event of a capture, or makes it late; one that is still on at the end raises.
#
# Expected: documentation of the BlackBox ToolKit's captures, in capture_output_to_dataframe: each line is a change of lines, with
#   the states after it and its time; the first of its example has lines on. capture_dataframe_to_events gives the onset of
#   each event and its duration.
# Seen: the first change is set to zero, time and states. Of three stimuli the first one's onset is gone: without another line
#   there are two events; if a trigger came 5 ms after it, the stimulus begins with the trigger, 5 ms late and 5 ms shorter.
#   The frame that was handed over is changed as well. A line that is still on at the end is an AssertionError.
# Hurts: checks of timing: a delay between stimulus and trigger is zero in the first trial, or trials are off by one.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check bbtkv2==0.3 numpy==2.4.6 pandas==3.1.1 pyserial==3.5 toml==0.10.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from bbtkv2 import capture_dataframe_to_events, capture_output_to_dataframe
from bbtkv2.bbtkv2 import DSC_LINE_NAMES


def capture(changes):
    """What the device sends: at each time (ms) the lines that are on."""
    rows = ["".join(str(int(name in on)) for name in DSC_LINE_NAMES[1:]) + f"{1000 * at:012d}" for at, on in changes]
    return capture_output_to_dataframe("SDAT;\n" + "".join(f"{row};\n" for row in rows) + "EDAT;\n")


def events(changes):
    table = capture_dataframe_to_events(capture(changes)).sort_values(["Type", "Onset"])
    return {name: [(float(a), float(b)) for a, b in zip(one.Onset, one.Duration)] for name, one in table.groupby("Type")}


alone, with_trigger = [], []
for start in (1000, 2000, 3000):
    alone += [(start, {"Opto1"}), (start + 100, set())]
    with_trigger += [(start, {"Opto1"}), (start + 5, {"Opto1", "TTLin1"}), (start + 15, {"Opto1"}), (start + 100, set())]
seen = [events(alone), events(with_trigger)]
print("three stimuli of 100 ms, at 1000, 2000 and 3000 ms:", seen[0])
print("the same with a trigger 5 ms after each:", seen[1])
try:
    events([*alone, (4000, {"Opto1"})])
    end = "no error"
except AssertionError:
    end = "AssertionError"
print("a fourth that is on at the end:", end)
print("bbtkv2", meta.version("bbtkv2"))
still = (
    seen[0] == {"Opto1": [(2000.0, 100.0), (3000.0, 100.0)]}
    and seen[1]["Opto1"] == [(1005.0, 95.0), (2000.0, 100.0), (3000.0, 100.0)]
    and seen[1]["TTLin1"] == [(1005.0, 10.0), (2005.0, 10.0), (3005.0, 10.0)]
    and end == "AssertionError"
)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
