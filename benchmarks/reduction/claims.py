"""A claim of the text beside what came out here, with a verdict, under the base and under every reading."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Generic, NamedTuple, TypeVar

from benchmarks.dissertation.claims import Claim

__all__ = ["ERRORS", "SHARE", "UNIT", "Found", "Statement", "about", "between", "number", "share", "told"]

ERRORS: Final = 2.0
"""Where both sides have a standard error, a number is reproduced within two of the difference,"""

UNIT: Final = 0.1
"""F1 and correlation, of which the text's is not known, within 0.1,"""

SHARE: Final = 0.3
"""and numbers of trials of which it is not known within 30 %."""

WIDE: Final = 0.2
"""Nothing is said to come out as printed if twice our own error could hold such a share of the text's number."""

SHOWN: Final = 3
"""Readings that a verdict names."""

_Context = TypeVar("_Context")


class Found(NamedTuple):
    """What one context shows of a claim: whether it holds, our words, how far off, and the difference in words.

    `weak` is why it says nothing that it holds: its own error, or the power of a test; empty if it does.
    """

    holds: bool
    ours: str
    off: float = math.nan
    difference: str = "–"
    weak: str = ""

    @property
    def says(self) -> bool:
        """Whether it holds, and could have failed."""
        return self.holds and not self.weak


@dataclass(frozen=True)
class Statement(Generic[_Context]):
    """A claim that is to be judged.

    Args:
        where: as in `Claim`.
        what: as in `Claim`.
        theirs: as in `Claim`.
        look: what a context shows of it.
        reason: what stands behind "not, because"; by default that no reading brings it, and which comes closest.
    """

    where: str
    what: str
    theirs: str
    look: Callable[[_Context], Found]
    reason: str = ""


def told(statement: Statement[_Context], contexts: Mapping[str, _Context]) -> Claim:
    """A statement with its verdict.

    Args:
        statement: the statement.
        contexts: results by the name of a reading; the first is the base.
    """
    found = {name: statement.look(context) for name, context in contexts.items()}
    base = next(iter(found.values()))
    verdict = _verdict(statement, found)
    return Claim(statement.where, statement.what, statement.theirs, base.ours, base.difference, verdict)


def _verdict(statement: Statement[_Context], found: Mapping[str, Found]) -> str:
    base, names = next(iter(found.values())), [name for name, one in found.items() if one.says]
    if base.holds:
        return f"cannot fail here: {base.weak}" if base.weak else "reproduced"
    if names:
        more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        return f"under reading {'; '.join(names[:SHOWN])}{more}"
    return f"not, because {statement.reason or _closest(found)}"


def _closest(found: Mapping[str, Found]) -> str:
    if len(found) == 1:
        return "it comes out otherwise, and no reading was tried for it"
    near = {name: abs(one.off) for name, one in found.items() if not math.isnan(one.off)}
    if not near:
        return f"it holds under none of {len(found)} readings"
    name = min(near, key=near.__getitem__)
    return f"none of {len(found)} readings comes near enough; the closest, {name}, has {found[name].ours}"


def share(ours: float, theirs: float) -> Found:
    """Whether a number is within 30 % of the text's."""
    off = ours / theirs - 1.0
    return Found(abs(off) <= SHARE + 1e-9, f"{ours:.1f}", off, f"{ours - theirs:+.1f} ({100 * off:+.0f} %)")


def between(ours: float, theirs: float, error: float, digits: int = 1, own: float = 0.0) -> Found:
    """Whether a number is the text's within two standard errors of the difference.

    Args:
        ours: ours.
        theirs: the text's.
        error: the standard error of their difference.
        digits: of our words.
        own: the standard error of ours alone.
    """
    off, most = (ours - theirs) / error, ERRORS * error
    apart = f"{ours - theirs - most:+.{digits}f} to {ours - theirs + most:+.{digits}f}"
    difference = f"{ours - theirs:+.{digits}f} ({apart}), {off:+.1f} standard errors"
    weak = ""
    if ERRORS * own > WIDE * abs(theirs):
        weak = f"its own error of {ERRORS * own:.{digits}f} could hold a fifth of the text's number"
    return Found(abs(off) <= ERRORS, f"{ours:.{digits}f}", off, difference, weak)


def number(ours: float, theirs: float, within: float = UNIT) -> Found:
    """Whether a number is as close to the text's as said."""
    off = ours - theirs
    return Found(abs(off) <= within + 1e-9, f"{ours:.2f}", off, f"{off:+.2f}")


def about(holds: object, ours: str, weak: str = "") -> Found:
    """Whether something holds, with our numbers in words, and why that may say nothing."""
    return Found(bool(holds), ours, weak=weak)
