#!/usr/bin/env bash
# ezpwr plans groups for a wanted precision with sizes and deviations exchanged: 3 and 6 persons where 37 and 74 are needed.
#
# Expected: mean.independent.ci.solve_size gives the sizes of two groups for which the confidence interval of the difference has
#   the wanted half width: solve_precision of these sizes is at most that, and with one person less it is more.
# Seen: if the first group is to be the smaller one (ratio below 1), the function under the root search gets the sizes in the
#   places of the standard deviations, and these for the sizes. For a precision of 4 with SDs of 10 and a ratio of 0.5 it says 3
#   and 6, which give 19. For groups of one size, the default, it raises ZeroDivisionError.
# Hurts: a study of a tenth of the size that it needs; larger SDs ask for fewer persons.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 ezpwr==0.0.8
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from ezpwr.mean.independent.ci import solve_precision, solve_size

WANTED = 4
still = True
for ratio, equal in ((2, True), (1, True), (0.5, True), (0.5, False), (1, False)):
    for sd in (10, 14):
        deviations = {"treatment_std": sd, "reference_std": sd, "equal_var": equal}
        needed = 4
        while solve_precision(treatment_size=round(needed * ratio), reference_size=needed, **deviations) > WANTED:
            needed += 2
        right = round(needed * ratio), needed
        case = f"ratio {ratio}, {'equal' if equal else 'unequal'} variances, SDs {sd}"
        try:
            sizes = solve_size(precision=WANTED, ratio=ratio, **deviations)
        except ZeroDivisionError as error:
            print(f"{case}: {error!r}; needed {right}")
            still &= ratio == 1
            continue
        reached = solve_precision(treatment_size=sizes[0], reference_size=sizes[1], **deviations)
        print(f"{case}: {sizes}, precision {reached:.2f}; needed {right}")
        still &= bool(reached > 3 * WANTED if ratio < 1 else WANTED - 0.1 < reached <= WANTED)
        still &= ratio != 1
print("ezpwr", meta.version("ezpwr"))
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
