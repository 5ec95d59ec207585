#!/usr/bin/env bash
# randomization's biased coins count the person to come: group 0 gets nearly one person more, and is guessed when balanced.
#
# Expected: documentation of efrons_biased_coin: the under-represented group gets the next person with probability 0.67, so
#   each has 0.5 when they are balanced; of weis_urn: group 0 has 1 - (persons in group 0) / (persons so far), so zero
#   after a first person in group 0.
# Seen: both divide by the number of persons so far plus one. Efron's coin takes balanced groups for too few in group 0 (0.67
#   for 0.5) and 1 to 0 for balanced (0.5 for 0.33). Wei's urn gives group 0 a second person with 0.5 for 0. Of 20 persons
#   group 0 has 0.9 more, on average.
# Hurts: allocation in small studies is uneven and can be guessed: after each balance the next one is in group 0.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check randomization==1.0.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from randomization import efrons_biased_coin, weis_urn

seen = {}
for name, assign in (("Efron", efrons_biased_coin), ("Wei", weis_urn)):
    lists = [assign(20, seed=seed) for seed in range(10000)]
    excess = sum(20 - 2 * sum(one) for one in lists) / len(lists)
    after_0 = [one[1] == 0 for one in lists if one[0] == 0]
    balanced = [one[10] == 0 for one in lists if sum(one[:10]) == 5]
    seen[name] = excess, sum(after_0) / len(after_0), sum(balanced) / len(balanced)
    print(f"{name}: group 0 minus group 1 {excess:+.2f} of 20; group 0 again after a first person in it {seen[name][1]:.2f}, "
          f"group 0 after five and five {seen[name][2]:.2f}")
print("randomization", meta.version("randomization"))
still = (
    all(one[0] > 0.8 for one in seen.values())
    and 0.47 < seen["Efron"][1] < 0.53
    and 0.64 < seen["Efron"][2] < 0.70
    and 0.47 < seen["Wei"][1] < 0.53
)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
