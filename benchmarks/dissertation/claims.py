"""What the dissertation says in a table or figure, what comes out here, and the verdict on it.

A benchmark leaves its claims in its committed JSON file, as a flat list under the key `claims`; the gallery collects
them.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final

from isiw.errors import InvalidValueError

__all__ = ["REPRODUCED", "Claim", "claims_as_json", "places", "read_claims"]

REPRODUCED: Final = "reproduced"
UNDER: Final = "under reading"
NOT: Final = "not, because"

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
        verdict: "reproduced", "under reading …" or "not, because …".

    Raises:
        InvalidValueError: an empty field, or a verdict of another form.
    """

    where: str
    what: str
    theirs: str
    ours: str
    difference: str
    verdict: str

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not isinstance(value, str) or not value.strip():
                raise InvalidValueError(f"a claim's {name} must be a text that is not empty", got=value)
        unfinished = self.verdict.strip(" :") in {UNDER, NOT}
        if unfinished or not (self.verdict == REPRODUCED or self.verdict.startswith((UNDER, NOT))):
            raise InvalidValueError(
                f"the verdict on {self.where} says nothing known",
                got=self.verdict,
                expected=f"{REPRODUCED!r}, '{UNDER} …' or '{NOT} …'",
                remedy="Say under which reading it comes out, or why it does not.",
            )


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
    if not isinstance(entry, dict) or set(entry) != names:
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
