#!/usr/bin/env bash
# bids-events gives all trials the duration of the first one, and leaves out the last row of the log.
#
# Expected: BIDS: duration is that of each event. The documentation of bids-events extracts trials from a log of Presentation, whose
#   rows have a duration each; a given duration takes its place.
# Seen: the first trial's duration is kept as if it had been given: cues of 0.5, 1, 2 and 0.75 s all have 0.5. The table's end is
#   one row early: the fourth cue, the last row, is missing.
# Hurts: models of responses to stimuli of several lengths; the last trial of each run is lost.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check bids-events==0.0.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from bids_events.presentation import LogHandler

cues = [(2.0, 0.5), (4.0, 1.0), (7.0, 2.0), (10.0, 0.75)]  # onset and duration in s
start = 50000  # times are in tenths of a millisecond
names = ["Subject", "Trial", "Event Type", "Code", "Time", "TTime", "Uncertainty", "Duration", "Uncertainty", "ReqTime", "ReqDur"]
rows = [names, [], ["p1", "1", "Pulse", "255", str(start), "0", "1"]]
for number, (onset, duration) in enumerate(cues, 2):
    time, length = str(start + round(1e4 * onset)), str(round(1e4 * duration))
    rows.append(["p1", str(number), "Picture", f"cue{number - 1}", time, "0", "1", length, "2", "0", length])
rows += [[], ["Event Type", "Code", "Type", "Response", "RT", "RT Uncertainty", "Time", "Uncertainty", "Duration"], []]
rows += [["Picture", "cue1", "other", "0", "", "", "70000", "1", "5000"]]
with open("run.log", "w") as file:
    file.write("Scenario - cues\nLogfile written - 01/01/2026 10:00:00\n\n")
    file.write("\n".join("\t".join(row) for row in rows) + "\n")

log = LogHandler("run.log")
log.extract_trials([["trial_type", LogHandler.COL_CODE, r"cue.*"]])
print("in the log:", [(onset, duration, f"cue{number}") for number, (onset, duration) in enumerate(cues, 1)])
print("extracted: ", [tuple(row) for row in log.trials[1:]])
print("bids-events", meta.version("bids-events"))
still = log.trials[1:] == [[2.0, 0.5, "cue1"], [4.0, 0.5, "cue2"], [7.0, 0.5, "cue3"]]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
