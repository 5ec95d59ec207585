#!/usr/bin/env bash
# questplus: looking at the next stimulus changes it, when it is chosen among the n best.
#
# Expected: `next_stim` is a property, and its docstring speaks of retrieving the stimulus: looked at twice between two
#   answers it says the same, as it does with the selection method "min_entropy".
# Seen: with "min_n_entropy" each look draws again from its random generator. Code that logs `q.next_stim`, shows it on
#   a screen and then sends it to the stimulator has three different stimuli for one trial, and the seed no longer gives the
#   same session when a line of logging is added.
# Hurts: the log states an intensity that was not delivered, and updates may be made with it.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    questplus==2023.1 numpy==2.4.6 scipy==1.17.1 xarray==2026.9.0 json-tricks==3.17.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
import questplus


def make(method):
    options = {"n": 4, "max_consecutive_reps": 2, "random_seed": 3} if method == "min_n_entropy" else None
    return questplus.QuestPlus(
        stim_domain={"intensity": np.arange(30.0, 71.0)},
        param_domain={
            "mean": np.arange(30.0, 71.0),
            "sd": np.array([2.0, 4.0, 8.0]),
            "lower_asymptote": np.array([0.01]),
            "lapse_rate": np.array([0.01]),
        },
        outcome_domain={"response": ["Yes", "No"]},
        func="norm_cdf",
        stim_scale="linear",
        stim_selection_method=method,
        stim_selection_options=options,
        param_estimation_method="mean",
    )


looks = {}
for method in ("min_entropy", "min_n_entropy"):
    quest = make(method)
    looks[method] = [float(quest.next_stim["intensity"]) for _ in range(8)]
    print(f"{method}: eight looks before the first trial: {looks[method]}")
print("questplus", meta.version("questplus"))
still = len(set(looks["min_entropy"])) == 1 and len(set(looks["min_n_entropy"])) > 1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
