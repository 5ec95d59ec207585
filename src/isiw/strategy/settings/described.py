"""The settings of a strategy for people: what each is called, its unit, its value, and what it means.

All of it is read from the classes that hold the settings: meanings from their docstrings, units from their names.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields, is_dataclass
from typing import Any, Final

import docstring_parser

from isiw.strategy.settings.common import Settings, settings_keys

_UNITS: Final = {"ms": "ms", "ms2": "ms²", "mv": "mV", "uv": "µV", "s": "s", "hz": "Hz"}


@dataclass(frozen=True)
class DescribedSetting:
    """One setting, or a group of them.

    Args:
        key: its name as in a configuration or a call of `make_strategy`; those of a group follow it, after a dot, and
            what the tables of a list have, after brackets.
        value: what it is by default; None where it is not set, and for a group. A list of tables is set as a whole.
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
    """All that can be set about a strategy, groups before their members."""
    return tuple(
        entry
        for key, setting in settings_keys(settings).items()
        for entry in _entries(key, setting.value, _meanings(setting.owner)[key])
    )


def _entries(key: str, value: Any, meaning: str) -> Iterator[DescribedSetting]:
    unit = _UNITS.get(key.rpartition("_")[2], "")
    plain = re.sub(rf"\s*\[{re.escape(unit)}\]", "", meaning) if unit else meaning
    if isinstance(value, tuple) and any(is_dataclass(each) for each in value):
        yield DescribedSetting(key, tuple(asdict(each) for each in value), unit, plain, group=False)
        for name, said in _meanings(type(value[0])).items():
            yield DescribedSetting(f"{key}[].{name}", None, "", said, group=True)
        return
    group = is_dataclass(value)
    yield DescribedSetting(key, None if group else value, unit, plain, group)
    if group:
        meanings = _meanings(type(value))
        for f in fields(value):
            yield from _entries(f"{key}.{f.name}", getattr(value, f.name), meanings[f.name])


def _meanings(owner: type) -> dict[str, str]:
    """What the docstring of a class says of each of its arguments, on one line."""
    documented = docstring_parser.parse(owner.__doc__ or "").params
    return {param.arg_name: " ".join((param.description or "").split()) for param in documented}
