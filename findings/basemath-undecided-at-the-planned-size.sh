#!/usr/bin/env bash
# basemath-analysis does not decide at exactly the number of samples it asks for: it needs one more.
#
# Expected: readme: required_samples is the maximum number of samples for each variation; the outcome is 1 if the treatment is
#   significantly better, which can only happen once that number has been reached; 0 is "no conclusion yet".
# Seen: who looks when exactly required_samples are there gets 0, "no conclusion yet", with an effect twice as large as the one
#   looked for, too. With one sample more, of which nothing is used, it is 1.
# Hurts: a study planned for that number, which is what the number is for, ends without a result.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==1.26.4 scipy==1.15.3
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps basemath-analysis==0.1.1
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from basemath_analysis.basemath import BaseMathsTest


def new():
    """A share of 20 % and a relative gain of 20 %, alpha 0.05 and beta 0.2."""
    return BaseMathsTest(0.2, 0.2, 0.05, 0.2, seed="experiment")


planned = new().required_samples
gain = round(0.08 * planned)  # twice the gain that is looked for
print(f"required_samples: {planned}")
outcomes = {}
for samples in (planned - 1, planned, planned + 1):
    outcomes[samples] = new().evaluate_experiment(0, gain, 0, samples)
    print(f"looked at after {samples}: {outcomes[samples]}")
one = new()
first = one.evaluate_experiment(0, gain, 0, planned)
second = one.evaluate_experiment(gain, 0, planned, 1)
print(f"looked at after {planned}: {first}, and once more with one sample without a difference: {second}")
print("basemath-analysis", meta.version("basemath-analysis"))
still = list(outcomes.values()) == [0, 0, 1] and (first, second) == (0, 1)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
