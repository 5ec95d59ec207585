"""The settings of a strategy for people: what each is called, its unit, its value, and what it means.

All of it is read from the classes that hold the settings: meanings from their docstrings, units from their names.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Final

import docstring_parser

from isiw.strategy.settings.common import Settings, settings_keys

__all__ = ["DescribedSetting", "described"]

_UNITS: Final = {"ms": "ms", "ms2": "ms²", "mv": "mV", "uv": "µV", "s": "s", "hz": "Hz"}


@dataclass(frozen=True)
class DescribedSetting:
    """One setting, or a group of them.

    Args:
        key: its name as in a configuration or a call of `make_strategy`; those of a group follow it, after a dot.
        value: what it is by default; None where it is not set, and for a group.
        unit: of the value; empty where it has none.
        meaning: what it is, in a sentence.
        group: whether its values are those of its members.
    """

    key: str
    value: Any
    unit: str
    meaning: str
    group: bool

    @property
    def parts(self) -> tuple[str, ...]:
        """What each number of the value is, where it has several with names of their own."""
        return getattr(self.value, "_fields", ())


def described(settings: Settings) -> tuple[DescribedSetting, ...]:
    """All that can be set about a strategy, groups before their members.

    Args:
        settings: what its name stands for.
    """
    return tuple(
        entry
        for key, setting in settings_keys(type(settings)).items()
        for entry in _entries(key, setting.of(settings), _meanings(setting.owner)[key])
    )


def _entries(key: str, value: Any, meaning: str) -> Iterator[DescribedSetting]:
    unit = _UNITS.get(key.rpartition("_")[2], "")
    plain = re.sub(rf"\s*\[{re.escape(unit)}\]", "", meaning) if unit else meaning
    several = isinstance(value, tuple) and any(is_dataclass(each) for each in value)
    group = is_dataclass(value) or several
    yield DescribedSetting(key, None if group else value, unit, plain, group)
    for member in value if several else [value] if group else []:
        meanings = _meanings(type(member))
        within = f"{key}[{value.index(member)}]" if several else key
        for f in fields(member):
            yield from _entries(f"{within}.{f.name}", getattr(member, f.name), meanings[f.name])


def _meanings(owner: type) -> dict[str, str]:
    """What the docstring of a class says of each of its arguments, on one line."""
    documented = docstring_parser.parse(owner.__doc__ or "").params
    return {param.arg_name: " ".join((param.description or "").split()) for param in documented}
