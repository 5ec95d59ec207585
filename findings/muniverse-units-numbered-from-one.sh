#!/usr/bin/env bash
# muniverse compares each unit with the match of the next unless units are numbered from zero: perfect agreement is none.
#
# Expected: docstring of evaluate_spike_matches: two tables with columns unit_id and onset are matched. A table compared
#   with itself has every spike as a true positive, whatever the units are called.
# Seen: the assignment holds positions, but is looked up by the unit's id. If ids begin at 1, as in EDF and MATLAB, unit 1
#   gets the partner of the second, and so on; the last has none. Of four units compared with themselves no spike matches;
#   ids from 4 on or texts ("MU1") match nothing at all. Nothing is raised.
# Hurts: a good decomposition scores zero in a comparison with another; with gaps in the ids (after bad units were removed)
#   it scores anything.
# (Only the module that compares is loaded: torch and the network parts are not needed.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps muniverse-emg==0.1.4
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types

import numpy as np
import pandas as pd

root = meta.distribution("muniverse-emg").locate_file("muniverse")
for name in ("muniverse", "muniverse.evaluation"):
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__path__ = [str(root.joinpath(*name.split(".")[1:]))]
from muniverse.evaluation.evaluate import evaluate_spike_matches

rng = np.random.default_rng(2)
trains = [np.cumsum(rng.normal(0.10 + 0.01 * unit, 0.015, 200)) for unit in range(4)]
seen = {}
for names in ([0, 1, 2, 3], [1, 2, 3, 4], [0, 2, 3, 5], ["MU1", "MU2", "MU3", "MU4"]):
    table = pd.DataFrame([(name, onset) for name, train in zip(names, trains) for onset in train], columns=["unit_id", "onset"])
    result = evaluate_spike_matches(table, table)
    seen[str(names)] = [int(tp) for tp in result["TP"]]
    print(f"units {names} against themselves: true positives of 200 each {seen[str(names)]}, partners {result['unit_id_ref'].tolist()}")
print("muniverse-emg", meta.version("muniverse-emg"))
zero, one, gaps, text = seen.values()
still = zero == [200] * 4 and one == [0] * 4 and text == [0] * 4 and gaps != [200] * 4
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
