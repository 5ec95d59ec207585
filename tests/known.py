"""What a value is, where its type leaves more open than a test expects."""

from __future__ import annotations

from typing import TypeVar

T = TypeVar("T")


def known(value: T | None) -> T:
    assert value is not None
    return value


def instance(kind: type[T], value: object) -> T:
    assert isinstance(value, kind)
    return value
