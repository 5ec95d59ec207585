#!/usr/bin/env bash
# labchart_tools leaves out the last sample of an export, and with it a comment that stands there.
#
# Expected: its description: processes data exported as text from LabChart; its TrialCleaner splits the blocks of a recording
#   into trials, with the comments of each, and has a check that all data are accounted for.
# Seen: the last block ends one row too early: of three blocks of five samples the last has four. A comment on the last sample
#   (LabChart writes comments in the row of their sample) is lost. No other block is cut.
# Hurts: the marker that ends a recording, or an answer noted at its end, is gone.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.2.6 pandas==2.3.3 plotly==5.24.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps labchart_tools==0.0.5
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from labchart_tools import RawReader, TrialCleaner

HEADER = ["Interval=\t0.001 s", "ExcelDateTime=\t4.4000000000000000e+04\t10/6/2020 10:00:00", "TimeFormat=\tStartOfBlock"]
HEADER += ["DateFormat=\t", "ChannelTitle=\tEMG\tForce", "Range=\t10.000 V\t10.000 V"]
lines = []
for block in range(3):
    lines += HEADER
    for sample in range(5):
        comment = {0: f"\t#* block {block} begins ", 4: f"\t#* block {block} ends "}.get(sample, "")
        lines.append(f"{sample / 1000:g}\t{block}.{sample}\t{sample}{comment}")
with open("export.txt", "w") as file:
    file.write("\n".join(lines) + "\n")
cleaner = TrialCleaner(RawReader("export.txt").run(), RawReader.time_col, RawReader.comment_col)
cleaner.main()
seen = []
for block, (trial, comments) in enumerate(zip(cleaner.trial_data, cleaner.comments)):
    seen.append((trial["EMG"].tolist(), [text.strip() for _, text in comments]))
    print(f"block {block}: samples {seen[-1][0]}, comments {seen[-1][1]}")
print("labchart_tools", meta.version("labchart_tools"))
still = [len(samples) for samples, _ in seen] == [5, 5, 4] and [len(comments) for _, comments in seen] == [2, 2, 1]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
