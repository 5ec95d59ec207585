"""What the dissertation says in a table or figure, what comes out here, and the verdict on it.

One rule for all claims. A number is judged by the standard errors of both sides where the text's can be known, and else
by a tolerance that is stated; a direction counts where it is two standard errors large. What comes out so is
"reproduced" only if it fails for a model that is wrong on purpose, which is really run and named. What holds for every
wrong model, or was put to none, "cannot fail here"; what was put in is "by construction", what was fitted is "fitted".

A benchmark leaves its claims in its committed JSON file, as a flat list under the key `claims`; the gallery collects
them.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

from isiw.errors import InvalidValueError

__all__ = [
    "KINDS",
    "NOT",
    "REPRODUCED",
    "Claim",
    "by_kind",
    "claims_as_json",
    "kind_of",
    "places",
    "put_to_test",
    "read_claims",
]

REPRODUCED: Final = "reproduced"
UNDER: Final = "under reading"
NOT: Final = "not, because"
UNTESTED: Final = ("by construction", "fitted", "cannot fail here")
"""How the fourth verdict begins: what holds, and says nothing."""

KINDS: Final = (REPRODUCED, UNDER, NOT, "holds, and could not fail")
"""The four kinds of verdict, of which the last is `UNTESTED`."""

NONE: Final = "–"

_PLACE = re.compile(
    r"\b(?P<kind>Table|Tables|Fig\.|Figs\.|Figure|Figures)\s+"
    r"(?P<numbers>(?:[1-9]|B)\.\d+(?:[a-z]\b)?(?:\s*(?:,|and|to|–|-|:)\s*(?:[1-9]|B)\.\d+(?:[a-z]\b)?)*)"
)
_NUMBER = re.compile(r"(?P<range>(?:–|-|to)\s*)?(?P<chapter>[1-9]|B)\.(?P<index>\d+)")


@dataclass(frozen=True)
class Claim:
    """One statement of the dissertation, held against what comes out here.

    Args:
        where: where it stands, such as "Table 6.2", "Fig. 4.31–4.33" or "5.4.1".
        what: the statement in one plain sentence.
        theirs: the text's numbers.
        ours: ours.
        difference: between them, in words or numbers.
        verdict: "reproduced", "under reading …", "not, because …", or how it holds without saying anything, as one of
            `UNTESTED` and what stands behind it.
        fails_for: the wrong models for which a reproduced claim fails.

    Raises:
        InvalidValueError: an empty field, or a verdict of another form.
    """

    where: str
    what: str
    theirs: str
    ours: str
    difference: str
    verdict: str
    fails_for: str = NONE

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not isinstance(value, str) or not value.strip():
                raise InvalidValueError(f"a claim's {name} must be a text that is not empty", got=value)
        unfinished = self.verdict.strip(" :") in {UNDER, NOT}
        if unfinished or not (self.verdict == REPRODUCED or self.verdict.startswith((UNDER, NOT, *UNTESTED))):
            raise InvalidValueError(
                f"the verdict on {self.where} says nothing known",
                got=self.verdict,
                expected=f"{REPRODUCED!r}, '{UNDER} …', '{NOT} …', or one of {UNTESTED}",
                remedy="Say under which reading it comes out, or why it does not.",
            )


def kind_of(claim: Claim) -> str:
    """Which of the four kinds of verdict it is, one of `KINDS`."""
    if claim.verdict == REPRODUCED:
        return REPRODUCED
    return next((kind for kind in (UNDER, NOT) if claim.verdict.startswith(kind)), KINDS[-1])


def by_kind(claims: Iterable[Claim]) -> dict[str, int]:
    """How many claims have each kind of verdict; all four are there."""
    counts = Counter(map(kind_of, claims))
    return {kind: counts[kind] for kind in KINDS}


def put_to_test(
    claims: Iterable[Claim], wrong: Mapping[str, Iterable[Claim]], put_in: Mapping[str, str] | None = None
) -> list[Claim]:
    """Claims of which "reproduced" are left only those that fail for a wrong model.

    Args:
        claims: as they come out.
        wrong: the same claims, or some of them, as they come out for each wrong model.
        put_in: of what holds because it was put in or fitted: the verdict, by the claim's words or how they begin.
    """
    tried = {name: {(c.where, c.what): c.verdict == REPRODUCED for c in others} for name, others in wrong.items()}
    return [_tested(claim, tried, put_in or {}) if claim.verdict == REPRODUCED else claim for claim in claims]


def _tested(claim: Claim, tried: Mapping[str, Mapping[tuple[str, str], bool]], put_in: Mapping[str, str]) -> Claim:
    known = next((verdict for words, verdict in put_in.items() if claim.what.startswith(words)), None)
    if known is not None:
        return replace(claim, verdict=known)
    holds = {
        name: found[claim.where, claim.what] for name, found in tried.items() if (claim.where, claim.what) in found
    }
    failing = [name for name, held in holds.items() if not held]
    if failing:
        return replace(claim, fails_for="; ".join(failing))
    why = f"it holds as well for {'; '.join(holds)}" if holds else "no wrong model was run for it"
    return replace(claim, verdict=f"cannot fail here: {why}")


def read_claims(path: Path) -> list[Claim]:
    """The claims that a benchmark has left in its JSON file.

    Args:
        path: of the file.

    Raises:
        InvalidValueError: a file without a list `claims`, or an entry that is no claim.
    """
    content = json.loads(path.read_text())
    entries = content.get("claims") if isinstance(content, dict) else None
    if not isinstance(entries, list):
        raise InvalidValueError(f"{path} has no list of claims", got=type(entries).__name__, expected="a list 'claims'")
    return [_claim(entry, path) for entry in entries]


def _claim(entry: Any, path: Path) -> Claim:
    names = {field.name for field in fields(Claim)}
    if not isinstance(entry, dict) or set(entry) | {"fails_for"} != names:
        raise InvalidValueError(f"an entry of {path} is no claim", got=entry, expected=f"the keys {sorted(names)}")
    return Claim(**entry)


def claims_as_json(claims: Iterable[Claim]) -> list[dict[str, str]]:
    """Claims as they are left in a JSON file."""
    return [asdict(claim) for claim in claims]


def places(where: str) -> list[str]:
    """The tables and figures that a claim names, as "Table 6.2" and "Fig. 4.31"; none where it names sections only.

    Args:
        where: as in a claim; ranges such as "Fig. 4.31–4.33" are written out.
    """
    found: list[str] = []
    for place in _PLACE.finditer(where):
        kind = "Table" if place["kind"].startswith("Table") else "Fig."
        last = 0
        for number in _NUMBER.finditer(place["numbers"]):
            index = int(number["index"])
            first = last + 1 if number["range"] else index
            found += [f"{kind} {number['chapter']}.{each}" for each in range(first, index + 1)]
            last = index
    return list(dict.fromkeys(found))
