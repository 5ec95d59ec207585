"""Numbers as other software and instruments write them, and numbers of things in words."""

from __future__ import annotations

import re
from typing import Final

_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_WHOLE: Final = re.compile(r"[0-9]{1,18}")


def read_number(text: str) -> float:
    """The number that a text is, in ASCII digits with a decimal point; Python itself would take 1_0_0 and ١٢, too."""
    if not _NUMBER.fullmatch(text):
        raise ValueError("no number with a decimal point")
    return float(text)


def read_whole(text: str) -> int | None:
    """The whole number that a text is, in ASCII digits without a sign; None where it is none."""
    return int(text) if _WHOLE.fullmatch(text) else None


def counted(count: int, one: str, several: str | None = None) -> str:
    """A number of things in words, such as "1 session" and "2 sessions"."""
    return f"{count} {one if count == 1 else several or f'{one}s'}"
