"""JSON from elsewhere: a key that is there twice is refused, since readers differ in which of the two counts."""

from __future__ import annotations

import json
import re
from typing import Any, Final

_NUMBERS: Final = re.compile(rb":\s*\[[^\[\]{}\"]*\]")
"""Lists of numbers: they make up most of a waveform, and have no keys."""


class DoubledKeyError(ValueError):
    """A key is there twice."""


def read_json(text: str | bytes) -> Any:
    """The values of a JSON text."""
    try:
        return json.loads(text, object_pairs_hook=once_each)
    except RecursionError as error:
        raise ValueError("it is nested without end") from error


def refuse_doubled(text: bytes) -> None:
    """Raise where a JSON text has a key twice; quick where it is long because of lists of numbers."""
    try:
        read_json(_NUMBERS.sub(b":0", text))
    except ValueError:  # a text may look like such a list
        read_json(text)


def once_each(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The values by their keys, none of which may be there twice."""
    values = dict(pairs)
    if len(values) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise DoubledKeyError(f"the key {twice[:80]!r} is there twice")
    return values
