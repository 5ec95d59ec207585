#!/usr/bin/env bash
# eegevt replaces each comment of a BESA event file by "Trig." and the number of the trigger.
#
# Expected: its documentation: load, export and manipulate event files of BESA; a file that is loaded and saved without a change has the
#   same events, with the free text in its column Comnt.
# Seen: the comment is read and dropped; on saving it is made of the trigger's number: "coil moved", "artefact" and the names of
#   blocks are gone. Codes that are changed in memory change the comment too. A row without a comment raises TypeError.
# Hurts: recoded files, which is what the package is made for: notes on trials that should be left out vanish.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation eegevt==0.3.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import pathlib
import sys

from eegevt.eventfile import load_efile, save_efile

HEAD, ROWS = "Tmu\tCode\tTriNo\tComnt", ["1000000\t1\t1\tblock 2, rest", "2500000\t1\t1\tcoil moved", "4000000\t1\t2\tartefact"]
pathlib.Path("P01.evt").write_text("\n".join([HEAD, *ROWS]) + "\n")
save_efile(load_efile("P01.evt"), "_recoded")
saved = pathlib.Path("P01_recoded.evt").read_text().splitlines()
for before, after in zip(ROWS, saved[1:]):
    print(repr(before), "->", repr(after))
pathlib.Path("P02.evt").write_text("\n".join([HEAD, "1000000\t1\t1"]) + "\n")
try:
    load_efile("P02.evt")
    raised = ""
except TypeError as error:
    raised = type(error).__name__
print("a row without a comment:", raised)
print("eegevt", meta.version("eegevt"))
still = [row.split("\t")[3] for row in saved[1:]] == ["Trig. 1", "Trig. 1", "Trig. 2"] and raised == "TypeError"
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
