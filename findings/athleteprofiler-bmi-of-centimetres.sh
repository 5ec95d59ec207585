#!/usr/bin/env bash
# athleteprofiler's body mass index is kilograms by square centimetres: 80 kg and 187 cm have 0.00229 kg/m².
#
# Expected: docstring of get_bmi: body mass by the square of the height, in kg/m², "resulting from mass in kilograms and height in metres"; the
#   height of an Athlete is in cm. That is 22.9.
# Seen: the centimetres are squared as they are, so that the index is a ten-thousandth; it is printed as "kg/m²". Besides, who has no date of
#   death cannot be described at all: its default is not empty, and TypeError is raised.
# Hurts: profiles of living athletes: none, or one with an index that is no unit's.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps athleteprofiler==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from athleteprofiler import Athlete

person = {"dob": "1984-12-14", "gender": "M", "height": 187, "bodyweight": 80}
athlete = Athlete(name="somebody", **person)
right = person["bodyweight"] / (person["height"] / 100) ** 2
print(f"{person['bodyweight']} kg, {person['height']} cm: {athlete.get_bmi()}, by the definition {right:.2f}")
problem = ""
try:
    print(athlete)
except TypeError as error:
    problem = str(error)
print("described:", problem)
print("with an empty date of death:", Athlete(name="somebody", **person, death_date=""))
print("athleteprofiler", meta.version("athleteprofiler"))
still = abs(athlete.get_bmi() * 10_000 - right) < 0.1 and "strptime" in problem
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
