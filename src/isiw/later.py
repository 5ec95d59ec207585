"""Fields of values that are worked out when somebody looks at them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Later(Generic[T]):
    """A value that is worked out when it is first looked at.

    Args:
        work: gives the value.
    """

    work: Callable[[], T]


class WorkedOut(Generic[T]):
    """A field that may be given as `Later`."""

    def __init__(self, name: str, default: T) -> None:
        self.name, self.default = name, default

    def __get__(self, instance: object, owner: type) -> T:
        if instance is None:  # a dataclass asks for the default
            return self.default
        value = instance.__dict__[self.name]
        if isinstance(value, Later):
            value = instance.__dict__[self.name] = value.work()
        known: T = value
        return known

    def __set__(self, instance: object, value: T | Later[T]) -> None:
        unset = isinstance(value, WorkedOut)  # a field has it for its default
        instance.__dict__[self.name] = self.default if unset else value
