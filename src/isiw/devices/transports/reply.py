"""What other software answered, read with suspicion: every value is checked, and a message names where it is from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final, Unpack

from isiw.checks import Bounds, number
from isiw.errors import DeviceError, InvalidValueError
from isiw.text import plain
from isiw.text.numbers import read_number

LONGEST_REPLY: Final = 65_536
"""The longest answer that is read [bytes]; waveforms are not part of it."""

_LONGEST_SHOWN: Final = 200
_POINT: Final = "Write numbers with a decimal point, as in 0.25, and without a unit."


@dataclass(frozen=True)
class Reply:
    """An answer of other software.

    Args:
        values: its values by key, as text or as numbers.
        source: where it is from, such as the name of a file.
    """

    values: Mapping[str, object]
    source: str

    def broken(self, what: str, *, got: object = None, expected: str | None = None, remedy: str = "") -> DeviceError:
        """The error of an answer that cannot be used; whether the pulse was given is not known then."""
        shown = plain(got) if isinstance(got, str) else got
        return DeviceError(f"{self.source}: {what}", got=shown, expected=expected, remedy=remedy or None)

    def require_known(self, keys: Iterable[str]) -> None:
        """Raise where there is a key that nobody asked for, such as one that was misspelt."""
        known = sorted(keys)
        for key in self.values:
            if key not in known:
                raise self.broken("unknown key", got=str(key), expected=f"one of {', '.join(known)}")

    def has(self, key: str) -> bool:
        """Whether there is a value of this key."""
        return self.values.get(key) is not None

    def text(self, key: str) -> str:
        """The text of a key, without anything that a terminal would obey; empty where there is none."""
        return plain(str(self.values.get(key, "")))[:_LONGEST_SHOWN]

    def number(self, key: str, **bounds: Unpack[Bounds]) -> float:
        """The number of a key."""
        value = self.values.get(key)
        if value is None:
            raise self.broken(f"{key} is missing", remedy="Every answer of this kind must have it.")
        if isinstance(value, str):
            try:
                value = read_number(value)
            except ValueError as error:
                raise self.broken(f"{key} is not a number", got=value, remedy=_POINT) from error
        try:
            return number(key, value, **bounds)
        except InvalidValueError as error:
            raise self.broken(error.what, got=error.got) from error

    def optional_number(self, key: str, **bounds: Unpack[Bounds]) -> float | None:
        """The number of a key; None where there is none."""
        return self.number(key, **bounds) if self.has(key) else None

    def whole(self, key: str) -> int:
        """The whole number of a key, at least 0."""
        value = self.number(key, least=0)
        if value != int(value):
            raise self.broken(f"{key} is not a whole number", got=self.values[key])
        return int(value)
