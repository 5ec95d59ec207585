#!/usr/bin/env bash
# befordata fills epochs that begin at or before the first sample with whatever is in memory, without a word.
#
# Expected: documentation of extract_epochs: epochs with a number of samples before and after each zero sample; incomplete epochs
#   are warned of.
# Seen: only epochs that begin after sample 0 are filled. One that begins exactly with the first sample, and so is complete, and one
#   that would begin before it, or after the end, are left as they were reserved: old numbers, of other data or of
#   none. There is no warning. (An epoch that is cut at the end is filled with zeros, and warned of.)
# Hurts: the first trial after the start of a recording: a mean over trials has numbers in it that nobody measured.
# (0.4.9, which needs Python 3.12, has the same lines.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 pandas==2.3.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps befordata==0.4.4
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import importlib
import importlib.metadata as meta
import sys
import types
import warnings

import numpy as np
import pandas as pd

root = str(meta.distribution("befordata").locate_file("befordata"))
package = sys.modules["befordata"] = types.ModuleType("befordata")  # its other modules need readers of files
package.__path__ = [root]
record_module, tools = (importlib.import_module(f"befordata.{name}") for name in ("_record", "_tools"))

force = 5.0 + np.arange(1000) / 1000
record = record_module.BeForRecord(pd.DataFrame({"Fz": force}), sampling_rate=1000)
seen = {}
for zero in (101, 100, 50):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        epoch = tools.extract_epochs(record, "Fz", n_samples=200, n_samples_before=100, zero_samples=[zero]).dat[0]
    start = zero - 100
    inside = epoch[max(-start, 0) :]  # what has been measured
    seen[zero] = bool(np.array_equal(inside, force[max(start, 0) : zero + 200])), len(caught)
    print(f"epoch from sample {start}: its measured part is {'right' if seen[zero][0] else 'not that of the record'}, warnings {seen[zero][1]}")
print("befordata", meta.version("befordata"))
still = seen == {101: (True, 0), 100: (False, 0), 50: (False, 0)}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
