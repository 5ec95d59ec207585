"""The header of a log of another version: what this one can read of it, and which parts it cannot, and why."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Final

import tomli_w
from pydantic import BeforeValidator, TypeAdapter, ValidationError

from isiw.design import DesignSpace
from isiw.devices.limits import Limits
from isiw.devices.protocol import DeviceInfo
from isiw.errors import LogError
from isiw.log.schema import AnyHeader, Header, with_reference
from isiw.signals.limits import SignalLimits

__all__ = ["as_toml", "first_fault", "header_in_parts"]

_SPACE: Final[TypeAdapter[DesignSpace]] = TypeAdapter(Annotated[DesignSpace, BeforeValidator(with_reference)])

_STAND_INS: Final[Mapping[str, Callable[[Mapping[str, Any]], object]]] = {
    "isiw_version": lambda _: "not known",
    "created": lambda _: "at an unknown time",
    "subject": lambda _: "",
    "seed": lambda _: 0,
    "strategy": lambda values: {"name": _name(values.get("strategy")), "seed": 0},
    "limits": lambda values: Limits.of_space(_SPACE.validate_python(values.get("space"))),
    "device": lambda values: DeviceInfo("not known", _SPACE.validate_python(values.get("space")).reference),
    "signals": lambda _: SignalLimits(),
    "timeout_s": lambda _: 30.0,
    "ask_deadline_s": lambda _: None,
    "visit": lambda _: {},
    "protocol": lambda _: {},
    "versions": lambda _: {},
    "asks_from": lambda _: 0,
    "config": lambda _: {},
}
"""What stands in for a part that cannot be read; without the others there is no header."""


def header_in_parts(values: Any) -> tuple[Header, dict[str, str]]:
    """A header, and why parts of it cannot be read; something neutral stands in for each of these.

    Args:
        values: what the log has.

    Raises:
        ValueError: a part that everything needs cannot be read.
    """
    unread: dict[str, str] = {}
    while True:
        try:
            return Header.model_validate(values), unread
        except ValidationError as error:
            part = str(error.errors()[0]["loc"][0]) if error.errors()[0]["loc"] else ""
            if part in unread or part not in _STAND_INS:
                raise
            unread[part] = first_fault(error)
            values = {**values, part: _STAND_INS[part](values)}


def _name(strategy: Any) -> str:
    name = strategy.get("name") if isinstance(strategy, Mapping) else None
    return name if isinstance(name, str) else "not known"


def first_fault(error: ValueError) -> str:
    """What is wrong with a record, without what pydantic says of where to read more.

    Args:
        error: what was raised when it was read.
    """
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False, include_input=False)[0]
        return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
    return str(error)


def as_toml(header: AnyHeader) -> bytes:
    """A header as a log has it once more, as TOML.

    Args:
        header: the header.

    Raises:
        LogError: something in it is not a TOML value.
    """
    try:
        return tomli_w.dumps(header.model_dump(mode="json", exclude_none=True)).encode()
    except (TypeError, ValueError) as error:
        raise LogError(
            f"the header cannot be written: {error}",
            remedy="Give subject, config and the strategy's settings as TOML values, and leave out what is None.",
        ) from error
