#!/usr/bin/env bash
# sprt decides by the last observation only: a test that ended at the fourth trial is undecided again, and then the opposite.
#
# Expected: it calls itself a package for Wald's sequential probability ratio test, which ends at the first observation beyond
#   a boundary; that is what its error rates are for.
# Seen: only the sum of all values is compared with the boundaries. Six responses, then fourteen failures, with 0.3 against 0.7:
#   the upper boundary is crossed at the fourth trial ("Reject"), ten trials are "Continue" and twenty are "Accept".
#   (Values are not checked either: the checks of each kind of data are never called, and 2, 3 and 5 pass as yes or no.)
# Hurts: a record of trials that is tested afterwards, or trials that come in blocks: the decision depends on where it ends.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    numpy==2.4.6 pandas==3.1.1 matplotlib==3.11.2 setuptools==80.9.0 wheel==0.45.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps --no-build-isolation sprt==0.0.1
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import contextlib
import importlib.metadata as meta
import io
import sys

from sprt import SPRTBinomial

values = [1] * 6 + [0] * 14
with contextlib.redirect_stdout(io.StringIO()):
    tests = [SPRTBinomial(alpha=0.05, beta=0.2, h0=0.3, h1=0.7, values=values[:count]) for count in range(1, 21)]
    unchecked = SPRTBinomial(alpha=0.05, beta=0.2, h0=0.3, h1=0.7, values=[2, 3, 5]).decision
seen = [test.decision for test in tests]
print("values", values)
for count in (3, 4, 8, 10, 13, 20):
    test = tests[count - 1]
    print(f"{count} trials: sum {test.cum_values[-1]}, boundaries {test.lowerBoundary[-1]:.1f} and {test.upperBoundary[-1]:.1f}: {seen[count - 1]}")
print("values 2, 3, 5:", unchecked)
print("sprt", meta.version("sprt"))
still = seen[:3] == ["Continue"] * 3 and seen[3] == "Reject" and seen[9] == "Continue" and seen[19] == "Accept" and unchecked == "Reject"
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
