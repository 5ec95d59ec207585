#!/usr/bin/env bash
# audiogram's "WHO 2021" grades are not those of WHO 2021: 22 dB is normal for mild, 38 dB mild for moderate, 96 dB profound for complete.
#
# Expected: docstring of severity_from_pta: "Uses WHO 2021 grading". World Report on Hearing (WHO 2021): normal below 20 dB HL, mild
#   to below 35, moderate to below 50, moderately severe to below 65, severe to below 80, profound to below 95, complete from 95.
# Seen: the limits are 25, 40, 55, 70 and 90 dB HL, which are older ones (Clark 1981), and there is no grade of complete loss. Half of all
#   values from 20 to 105 dB have a grade lower than WHO's, none has a higher one.
# Hurts: prevalences and referrals under WHO's name: the loss from which WHO counts a person as impaired begins 5 dB too late.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps audiogram==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from audiogram.metrics import severity_from_pta, severity_from_thresholds

GRADES = ["normal", "mild", "moderate", "moderately_severe", "severe", "profound", "complete"]
WHO = [20, 35, 50, 65, 80, 95]


def who(pta):
    return GRADES[sum(pta >= limit for limit in WHO)]


rows = [(pta, severity_from_pta(pta), who(pta)) for pta in range(10, 106)]
for pta in (19, 22, 25, 38, 52, 68, 85, 96):
    print(f"pure-tone average {pta} dB HL: audiogram {severity_from_pta(pta)}, WHO 2021 {who(pta)}")
lower = sum(GRADES.index(seen) < GRADES.index(right) for pta, seen, right in rows if pta >= 20)
higher = sum(GRADES.index(seen) > GRADES.index(right) for _, seen, right in rows)
print(f"of the {len([row for row in rows if row[0] >= 20])} values from 20 to 105 dB {lower} have a grade below WHO's, {higher} one above")
ear = severity_from_thresholds({500: 35, 1000: 40, 2000: 35, 4000: 45}, standard="who2021")
print("thresholds 35, 40, 35, 45 dB, standard who2021:", ear, "- WHO 2021:", who(38.75))
print("audiogram", meta.version("audiogram"))
still = (severity_from_pta(22), severity_from_pta(38), severity_from_pta(96), ear) == ("normal", "mild", "profound", "mild")
still = still and lower > 30 and higher == 0
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
