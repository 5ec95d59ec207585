#!/usr/bin/env bash
# dose-response turns the sign of the caller's log doses: converted a second time they are 1000 and 10 for 0.001 and 0.1.
#
# Expected: docstring of DoseResponse.from_logs: converts logarithms, negative ones or not, to doses; what is handed over is not
#   changed, and converting twice gives the same.
# Seen: with neg=False the array is multiplied by -1 in place. The logs -3 and -1 are 3 and 1 afterwards, and a second call, for
#   another compound on the same doses, has the inverse doses. With another unit the array is shifted too.
# Hurts: a plate with several compounds: every second curve falls where it rises, and its EC50 is the inverse.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2 polars==2.1.0 \
    typing-extensions==4.16.0
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps dose-response==0.0.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import numpy as np
from dose_response.drc import DoseResponse

logs = np.array([-3.0, -2.0, -1.0])
first = DoseResponse.from_logs(logs, neg=False)
print("doses of the logs -3, -2, -1:", first.round(4).tolist(), "; the caller's logs afterwards:", logs.tolist())
after = logs.tolist()
second = DoseResponse.from_logs(logs, neg=False)
print("the same once more:", second.round(4).tolist())
print("dose-response", meta.version("dose-response"))
still = np.allclose(first, [0.001, 0.01, 0.1]) and after == [3.0, 2.0, 1.0] and np.allclose(second, [1000, 100, 10])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
