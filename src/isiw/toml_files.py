"""TOML files, read and checked: what is wrong is told by file, key and value, with the way out."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args, get_type_hints

from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from isiw.errors import ConfigError, IsiwError

__all__ = ["checked", "read_toml"]

_T = TypeVar("_T")

_UNKNOWN = {"extra_forbidden", "unexpected_keyword_argument"}


def read_toml(path: str | Path) -> dict[str, Any]:
    """The values of a TOML file.

    Raises:
        ConfigError: it cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(
            f"the configuration cannot be read: {error.strerror}", got=str(path), remedy="Check the path."
        ) from error
    except ValueError as error:  # not TOML, or not UTF-8
        raise ConfigError(f"{path} is not valid TOML: {error}", remedy="Mend the line that it names.") from error


def checked(kind: type[_T], values: Mapping[str, Any], source: str) -> _T:
    """Values as an instance of a pydantic model or a dataclass.

    Args:
        kind: the model or dataclass.
        values: its fields, as TOML has them.
        source: where they are from, for the message.

    Raises:
        ConfigError: an unknown key or a bad value; the message names source, key and value.
    """
    try:
        return TypeAdapter(kind).validate_python(values)
    except ValidationError as error:
        found = error.errors()
        # A key that was misspelt is reported before the one that is missing because of it.
        raise _explained(kind, next((e for e in found if e["type"] in _UNKNOWN), found[0]), source) from error


def _explained(kind: Any, error: ErrorDetails, source: str) -> ConfigError:
    key = ".".join(str(part) for part in error["loc"])
    if error["type"] in _UNKNOWN:
        known = _known_keys(kind, error["loc"][:-1])
        close = difflib.get_close_matches(str(error["loc"][-1]), known, n=1)
        return ConfigError(
            f"{source}: the key {key} is unknown",
            got=error["input"],
            expected=f"one of {', '.join(known)}",
            remedy=f"{f'Did you mean {close[0]}? ' if close else ''}Correct it or remove it.",
        )
    if error["type"] == "missing":
        return ConfigError(f"{source}: the key {key} is missing", remedy="Add it.")
    what, remedy = f"{source}: the value of {key} cannot be used", "Correct it, or remove the key for its default."
    own = error.get("ctx", {}).get("error")
    if isinstance(own, IsiwError):
        return ConfigError(f"{what}: {own.what}", got=own.got, expected=own.expected, remedy=own.remedy or remedy)
    return ConfigError(what, got=error["input"], expected=error["msg"].removeprefix("Input should be "), remedy=remedy)


def _known_keys(kind: Any, section: tuple[int | str, ...]) -> list[str]:
    for name in section:
        kind = get_args(kind)[0] if isinstance(name, int) else get_type_hints(kind)[name]
    return sorted(f.name for f in fields(kind)) if is_dataclass(kind) else sorted(kind.model_fields)
