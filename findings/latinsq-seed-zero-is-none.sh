#!/usr/bin/env bash
# latinsq takes the seed 0 for none: each call draws another square.
#
# Expected: LatinSquare.random(n, rng_seed=...) repeats its square for the same seed, as for every other number.
# Seen: the seed is asked whether it is true, so that 0 is the same as none: 20 calls draw 20 squares, where 1 draws one.
# Hurts: an order of conditions that is made anew from its seed (0 is the usual one) when the session is continued or analysed:
#   each person's conditions are other ones than those given.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps latinsq==0.2.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from latinsq import LatinSquare

seen = {seed: len({LatinSquare.random(6, rng_seed=seed).square.tobytes() for _ in range(20)}) for seed in (0, 1, 2)}
for seed, number in seen.items():
    print(f"seed {seed}: {number} different squares in 20 calls")
print("latinsq", meta.version("latinsq"))
still = seen[0] > 15 and seen[1] == seen[2] == 1
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
