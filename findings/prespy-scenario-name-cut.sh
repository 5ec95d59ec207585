#!/usr/bin/env bash
# prespy cuts the name of a scenario at its first hyphen: "go-left" and "go-right" are both "go".
#
# Expected: Record.exp.name is the scenario of a Presentation log, whose first line is "Scenario - NAME".
# Seen: the line is split at each hyphen and the second part is taken, so that what follows a hyphen in the name is lost without a word.
# Hurts: sessions or conditions with hyphens in their names are merged.
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

from prespy.logfile import load

names = ["Subject", "Trial", "Event Type", "Code", "Time", "TTime", "Uncertainty", "Duration", "Uncertainty"]
row = ["s1", "1", "Picture", "face", "35000", "0", "1", "", ""]
seen = {}
for scenario in ("go-left", "go-right", "n-back 2", "rest"):
    lines = [f"Scenario - {scenario}", "Logfile written - 03/02/2021 10:11:12", "", "\t".join(names), "", "\t".join(row), ""]
    Path("run.log").write_text("\n".join(lines))
    seen[scenario] = load("run.log").exp.name
    print(f"Scenario - {scenario}: {seen[scenario]!r}")
print("prespy", meta.version("prespy"))
still = seen == {"go-left": "go", "go-right": "go", "n-back 2": "n", "rest": "rest"}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
