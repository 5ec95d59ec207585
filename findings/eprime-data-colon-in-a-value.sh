#!/usr/bin/env bash
# eprime-data drops values with a colon, and gives every session that was broken off the subject -1.
#
# Expected: its readme: converts the text files of E-Prime, which have one line "name: value" for each logged attribute; a value
#   may be any text. E-Prime writes this file during the session, so it is what is left of one that was broken off; the
#   subject is in its header. Tables have a column subject_id.
# Seen: a line with a second colon and blank is left out without a word: the cell of "He said: go" is empty. The header is not
#   read: the subject is taken from the last frame, that of the whole session, which a broken one lacks, and is -1.
# Hurts: sentences, instructions and written answers with a colon are lost; the sessions for which one needs the text file
#   cannot be told apart.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps eprime_data==0.2.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from eprime_data import EPrimeLogFile

SENTENCES = ("He said go", "He said: go", "Go")
header = ["*** Header Start ***", "VersionPersist: 1", "LevelName: Session", "Experiment: Demo", "Subject: 17", "*** Header End ***"]
trials = [
    f"\t{line}"
    for number, sentence in enumerate(SENTENCES)
    for line in ("Level: 2", "*** LogFrame Start ***", f"Sentence: {sentence}", f"Go.RT: {400 + number}", "*** LogFrame End ***")
]
session = ["Level: 1", "*** LogFrame Start ***", "Experiment: Demo", "Subject: 17", "*** LogFrame End ***"]
seen = {}
for name, lines in (("whole", header + trials + session), ("broken off", header + trials)):
    with open("log.txt", "w", encoding="utf-16", newline="\r\n") as file:
        file.write("\n".join(lines) + "\n")
    data = EPrimeLogFile("log.txt").data(level=2)
    seen[name] = (data["subject_id"], data["Sentence"], data["Go_RT"])
    print(f"{name}: subject {data['subject_id']}, sentences {data['Sentence']}, times {data['Go_RT']}")
print("eprime_data", meta.version("eprime_data"))
left = ["He said go", None, "Go"]
still = seen == {"whole": ([17] * 3, left, [400, 401, 402]), "broken off": ([-1] * 3, left, [400, 401, 402])}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
