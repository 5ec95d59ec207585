#!/usr/bin/env bash
# prespy does not find its own default pulse code, since codes are text: mri_timing raises for each log with pulses of 199.
#
# Expected: signature and docstring of mri_timing: events relative to the first pulse, whose code is 199 by default.
# Seen: codes of a Presentation log are read as text and compared with the number 199, so that none is equal: DataNotFoundError says that
#   pulse code 199 is not in the file. With pulsecode="199" all is found.
# Hurts: whoever calls it as documented, or gives the code as a number, as Presentation shows it.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps prespy==0.0.12
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from pathlib import Path

from prespy.exceptions import DataNotFoundError
from prespy.mri import mri_timing

head = ["Scenario - rest", "Logfile written - 03/02/2021 10:11:12", ""]
names = ["Subject", "Trial", "Event Type", "Code", "Time", "TTime", "Uncertainty", "Duration", "Uncertainty"]
rows = [["s1", "1", "Pulse", "199", "20000", "0", "1", "", ""], ["s1", "2", "Picture", "face", "35000", "0", "1", "", ""]]
rows.append(["s1", "3", "Pulse", "199", "40000", "0", "1", "", ""])
Path("run.log").write_text("\n".join(head + ["\t".join(names), ""] + ["\t".join(row) for row in rows] + [""]))
message = ""
try:
    mri_timing("run.log", events=["face"])
except DataNotFoundError as problem:
    message = str(problem)
print("by default:", message)
as_text = dict(mri_timing("run.log", pulsecode="199", events=["face"]))
print("with the code as text:", as_text)
print("prespy", meta.version("prespy"))
still = "199 not found" in message and as_text == {"pulses": [0.0, 2.0], "face": [1.5]}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
