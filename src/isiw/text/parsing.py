"""TOML and JSON texts from elsewhere as values, within limits, whoever wrote them."""

from __future__ import annotations

import json
import re
import tomllib
from collections import Counter
from collections.abc import Iterable
from typing import Any, Final

LARGEST: Final = 2**20
"""Of a text [characters]; what isiw itself writes has some ten thousand."""

_TOO_MANY_PARTS: Final = re.compile(r"""(?:\.[ \t]*+(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+){100}""")

_MOST_BITS: Final = 256
"""Of a whole number; TOML asks for 64, and some seeds have 128."""


def parsed(text: str) -> dict[str, Any]:
    """The values of a TOML text."""
    if len(text) > LARGEST:
        raise ValueError(f"it is longer than {LARGEST} characters")
    if _TOO_MANY_PARTS.search(text):
        raise ValueError("a key has more than a hundred parts")
    values = tomllib.loads(text)
    _require_moderate(values)
    return values


def _require_moderate(value: object, key: str = "") -> None:
    """Raise if a whole number is too large even to be printed."""
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:
        raise ValueError(f"{key} is a whole number of {value.bit_length()} bits, at most {_MOST_BITS} can be read")
    items: Iterable[tuple[object, object]] = ()
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, list):
        items = enumerate(value)
    for name, inner in items:
        _require_moderate(inner, f"{key}.{name}".lstrip("."))


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
    """Raise if a JSON text has a key twice; quick if it is long because of lists of numbers."""
    try:
        read_json(_NUMBERS.sub(b":0", text))
    except ValueError:  # a text may look like such a list
        read_json(text)


def once_each(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The values by their keys, none of which may be there twice."""
    values = dict(pairs)
    if len(values) < len(pairs):
        times = Counter(key for key, _ in pairs)
        twice = next(key for key in times if times[key] > 1)
        raise DoubledKeyError(f"the key {twice[:80]!r} is there twice")
    return values
