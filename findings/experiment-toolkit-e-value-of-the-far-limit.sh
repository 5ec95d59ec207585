#!/usr/bin/env bash
# experiment-toolkit's E-value of the interval is that of the limit farther from 1: 6.1 for a protective effect that may be none.
#
# Expected: docstring of e_value: the E-value of VanderWeele and Ding (2017), for the point estimate and for the interval, with its lower
#   limit. By their definition the interval's value is that of the limit closer to 1, never above the estimate's, and 1 if it includes 1.
# Seen: the lower limit is used whether the risk is raised or lowered. A risk ratio of 0.5 (0.3 to 1.2) has 3.41 for the estimate and 6.12
#   for the interval; the same result the other way round, 2.0 (0.83 to 3.3), has 3.41 and 1.
# Hurts: treatments that protect: the less precise the study, the more robust it is said to be.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.13.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps experiment-toolkit==0.2.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from experiment_toolkit import e_value

protective, harmful = e_value(0.5, lower_ci=0.3), e_value(2.0, lower_ci=1 / 1.2)
print(f"0.5 (0.3 to 1.2): {protective.e_value_point:.2f}, interval {protective.e_value_ci:.2f}")
print(f"the same turned, 2.0 (0.83 to 3.3): {harmful.e_value_point:.2f}, interval {harmful.e_value_ci:.2f}")
wide, narrow = e_value(0.5, lower_ci=0.1).e_value_ci, e_value(0.5, lower_ci=0.45).e_value_ci
print(f"0.5 with a lower limit of 0.45: {narrow:.2f}, of 0.1: {wide:.2f}")
print("experiment-toolkit", meta.version("experiment-toolkit"))
still = protective.e_value_ci > protective.e_value_point > 3.4 and harmful.e_value_ci == 1 and wide > narrow
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
