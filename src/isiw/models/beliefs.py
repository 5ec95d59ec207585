"""A prior from settings, as they stand in a configuration or in a log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

from isiw.errors import InvalidValueError

__all__ = ["prior_with"]

P = TypeVar("P")


def prior_with(settings: Mapping[str, Any], kind: type[P]) -> P:
    """The prior that has these settings; what is not among them is as by default.

    Args:
        settings: fields of the prior, pairs and rows as lists or tuples.
        kind: the prior's dataclass.

    Raises:
        InvalidValueError: a setting that the prior does not have.
    """
    known = [f.name for f in fields(kind)]  # type: ignore[arg-type] # every prior is a dataclass
    unknown = sorted(set(settings) - set(known))
    if unknown:
        raise InvalidValueError("the prior has no such setting", got=unknown, expected=", ".join(known))
    return kind(**{name: tuple(value) if isinstance(value, list) else value for name, value in settings.items()})
