"""The header of a log of another version: what this one can read of it, and which parts it cannot, and why."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

import tomli_w
from pydantic import BeforeValidator, TypeAdapter, ValidationError

from isiw.design import DesignSpace
from isiw.devices.limits import Limits
from isiw.devices.protocol import DeviceInfo
from isiw.errors import LogError
from isiw.log.schema import ANY_HEADER, AnyHeader, kind_tag, with_reference
from isiw.signals.limits import SignalLimits
from isiw.types import Reference

_SPACE: Final[TypeAdapter[DesignSpace]] = TypeAdapter(Annotated[DesignSpace, BeforeValidator(with_reference)])

_STAND_INS: Final[Mapping[str, Callable[[Mapping[str, Any]], object]]] = {
    "isiw_version": lambda _: "not known",
    "created": lambda _: "at an unknown time",
    "subject": lambda _: "",
    "seed": lambda _: 0,
    "strategy": lambda values: {"name": _name(values.get("strategy")), "seed": 0},
    "limits": lambda values: Limits.of_space(_SPACE.validate_python(values.get("space"))),
    "device": lambda values: DeviceInfo("not known", _reference(values)),
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


def header_in_parts(values: Any) -> tuple[AnyHeader, dict[str, str]]:
    """A header, and why parts of it cannot be read; something neutral stands in for each of these."""
    unread: dict[str, str] = {}
    while True:
        try:
            return ANY_HEADER.validate_python(values), unread
        except ValidationError as error:
            _, part, *_ = (*map(str, error.errors()[0]["loc"]), "", "")  # the first is the header's kind
            if part in unread or part not in _STAND_INS:
                raise
            unread[part] = first_fault(error)
            values = {**values, part: _STAND_INS[part](values)}


def _reference(values: Mapping[str, Any]) -> Reference:
    return "impact" if kind_tag(values) == "threshold" else _SPACE.validate_python(values.get("space")).reference


def _name(strategy: Any) -> str:
    name = strategy.get("name") if isinstance(strategy, Mapping) else None
    return name if isinstance(name, str) else "not known"


def require_read(path: Path, unread: Mapping[str, str], parts: Sequence[str] = ()) -> None:
    """Raise where a part of a header is needed that this version cannot read."""
    needed = {part: why for part, why in unread.items() if part in parts or not parts}
    if needed:
        raise LogError(
            f"what is needed of the log's header cannot be read: {', '.join(needed)}",
            got=f"{path}: {'; '.join(needed.values())}",
            remedy="Use the version of isiw that wrote it; isiw show, plot, report and export show the rest.",
        )


def first_fault(error: ValueError) -> str:
    """What is wrong with a record, without what pydantic says of where to read more."""
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False, include_input=False)[0]
        where = first["loc"][first["loc"][:1] in {("session",), ("threshold",), ("production",)} :]  # without the kind
        return f"{'.'.join(map(str, where))}: {first['msg']}"
    return str(error)


def as_toml(header: AnyHeader) -> bytes:
    """A header as a log has it once more, as TOML."""
    try:
        return tomli_w.dumps(header.model_dump(mode="json", exclude_none=True)).encode()
    except (TypeError, ValueError) as error:
        raise LogError(
            f"the header cannot be written: {error}",
            remedy="Give subject, config and the strategy's settings as TOML values, and leave out what is None.",
        ) from error
