#!/usr/bin/env bash
# SurvivalPy takes who is censored at the time of an event for gone before it: the survival of the textbook's example is 0.850 for 0.857.
#
# Expected: README: Kaplan-Meier survival analysis; its test names Freireich's leukaemia data. Kaplan and Meier (1958): who is lost at the
#   time of an event is still at risk then. Freireich's remissions under 6-MP have 0.857, 0.807, 0.753, 0.690, 0.627, 0.538 and 0.448.
# Seen: those who are censored at the same time are subtracted first, so that each event weighs more: 0.850, 0.800, 0.743, 0.681, 0.619, 0.531
#   and 0.442.
# Hurts: times in whole days, weeks or visits, in which both happen at once: all survivals are too low; with many at one time by a lot.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps survivalpy==1.0.2 scipy==1.13.1 numpy==1.26.4
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from survivalpy.survival import Analyzer, Datum

events = [6, 6, 6, 7, 10, 13, 16, 22, 23]
lost = [6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35]
people = [Datum(time, False) for time in events] + [Datum(time, True) for time in lost]
intervals = Analyzer(people).compute()
survival, right = 1.0, []
for time in sorted(set(events)):
    at_risk = sum(one >= time for one in events + lost)
    survival *= 1 - events.count(time) / at_risk
    right.append(round(survival, 3))
seen = [round(one.cumulative, 3) for one in intervals[1:]]
print("survival after each event, by the definition:", right)
print("SurvivalPy:                                  ", seen)
half = [Datum(1, False)] * 2 + [Datum(1, True)] * 6 + [Datum(2, False)] * 2
low = Analyzer(half).compute()[1].cumulative
print(f"two of ten have an event at visit 1, where six leave: 0.8, SurvivalPy {low:.2f}")
print("SurvivalPy", meta.version("SurvivalPy"))
still = right == [0.857, 0.807, 0.753, 0.69, 0.627, 0.538, 0.448] and seen == [0.85, 0.8, 0.743, 0.681, 0.619, 0.531, 0.442] and low == 0.5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
