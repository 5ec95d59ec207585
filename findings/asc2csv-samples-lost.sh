#!/usr/bin/env bash
# asc2csv drops all samples of an EyeLink file up to 1000 Hz; a saccade's average velocity is made with its duration.
#
# Expected: its documentation: gaze samples, saccades, blinks and fixations of an .asc file are put into the table. EyeLink: a sample's
#   line is time, x, y and pupil size, with a time in whole milliseconds up to 1000 Hz; missing data are a dot.
# Seen: a line is taken for a sample only if its time has a point and six columns follow: of a recording at 1000 Hz not one is
#   in the table, only events are. At 2000 Hz they are, and missing gaze is at 0, 0, the screen's corner. The average velocity of
#   a saccade is half the sum of its peak velocity (300 degrees a second) and its duration (40 ms): 170.
# Hurts: gaze during TMS or a psychophysical task: tables without any gaze, and a velocity that is none.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check asc2csv==1.4.1 pandas==3.1.1 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import pandas as pd
from asc2csv import process_asc_file


def table(rate):
    """Convert a second of gaze at a rate, with a saccade of 40 ms and missing data at the end."""
    lines = ["MSG\t1000 TRIALID 1", f"START\t1000 \tRIGHT\tSAMPLES\tEVENTS", f"SAMPLES\tGAZE\tRIGHT\tVEL\tRATE\t{rate}.00\tTRACKING\tCR"]
    for sample in range(rate):
        at = 1000 + 1000 * sample / rate
        gaze = "  512.0\t  384.0\t 1200.0\t    1.0\t    1.0\t..." if sample < rate - 10 else "   .\t   .\t    0.0\t   .\t   .\t..."
        lines.append(f"{at:.1f}\t{gaze}" if rate > 1000 else f"{at:.0f}\t{gaze}")
    lines += ["ESACC R  1500\t1539\t40\t  512.0\t  384.0\t  600.0\t  384.0\t   3.00\t    300", "END\t2000 \tSAMPLES\tEVENTS"]
    with open("a.asc", "w") as file:
        file.write("\n".join(lines) + "\n")
    process_asc_file("a.asc", "a.csv")
    return pd.read_csv("a.csv")


seen = {}
for rate in (1000, 2000):
    read = table(rate)
    gaze = read[read["Gaze X"].notna()]
    saccade = read[read["Event Type"] == "Saccade"].iloc[0]
    seen[rate] = len(gaze), int(((gaze["Gaze X"] == 0) & (gaze["Gaze Y"] == 0)).sum()), float(saccade["Average Velocity"])
    print(f"{rate} Hz: {seen[rate][0]} of {rate} samples, {seen[rate][1]} of them at 0, 0; average velocity {seen[rate][2]:g}, "
          f"peak {saccade['Peak Velocity']:g}, duration {saccade['Duration']:g}")
print("asc2csv", meta.version("asc2csv"))
still = seen == {1000: (0, 0, 170.0), 2000: (2000, 10, 170.0)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
