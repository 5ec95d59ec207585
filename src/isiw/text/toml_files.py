"""TOML files, read and checked: what is wrong is named by file, key and value, with the way out."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Final, TypeVar, cast, get_args, get_type_hints

from pydantic import BaseModel, ConfigDict, ValidationError, create_model
from pydantic_core import ErrorDetails

from isiw.errors import ConfigError, IsiwError, did_you_mean, os_errors
from isiw.text.parsing import LARGEST, parsed

UNKNOWN: Final = {"extra_forbidden", "unexpected_keyword_argument"}
"""Pydantic's types of error for a key that there is not."""

_KINDS: Final = {
    "bool": "true or false",
    "dataclass": "a table of keys and values",
    "dict": "a table of keys and values",
    "float": "a number",
    "int": "a whole number",
    "list": "a list",
    "mapping": "a table of keys and values",
    "model": "a table of keys and values",
    "path": "a path",
    "string": "text",
    "tuple": "a list",
}


def expected_instead(error: ErrorDetails) -> str:
    """The description of what should have been there, for after "expected"."""
    kind, _, fault = error["type"].partition("_")
    if kind in _KINDS and fault in {"type", "parsing", "from_float", "attributes_type"}:
        return _KINDS[kind]
    return error["msg"].removeprefix("Input should be ")


def meant_instead(error: ErrorDetails, keys: Sequence[str] = ()) -> str:
    """A question about what was probably meant; empty if nothing that there is comes near."""
    if error["type"] in UNKNOWN:
        return did_you_mean(error["loc"][-1], keys)
    if error["type"] == "literal_error":  # pydantic tells the values in quotes
        return did_you_mean(error["input"], re.findall(r"'([^']*)'", error["ctx"]["expected"]))
    return ""


def first_to_tell(errors: Sequence[ErrorDetails]) -> ErrorDetails:
    """Of several errors the one to tell: a key that was misspelt before the one that is missing because of it."""
    return next((error for error in errors if error["type"] in UNKNOWN), errors[0])


def known_keys(kind: Any, section: Sequence[int | str]) -> list[str]:
    """The keys that there are in a section."""
    for name in section:
        kind = get_args(kind)[0] if isinstance(name, int) else get_type_hints(kind)[name]
        if isinstance(kind, UnionType):  # a section that may be left out
            kind = next(each for each in get_args(kind) if each is not NoneType)
    if is_dataclass(kind):
        return sorted(field.name for field in fields(kind))
    return sorted(kind.model_fields if hasattr(kind, "model_fields") else kind._fields)  # else a named tuple


_T = TypeVar("_T")


def read_toml(path: str | Path) -> dict[str, Any]:
    """The values of a TOML file."""
    try:
        with (
            os_errors(ConfigError, "the TOML file cannot be read", path, "Check the path."),
            Path(path).open(encoding="utf-8-sig") as file,  # with the mark that Windows puts first
        ):
            text = file.read(LARGEST + 1)
        return parsed(text)
    except ConfigError:
        raise
    except UnicodeDecodeError as error:
        raise ConfigError(
            "this is not a TOML file, or it is not saved as UTF-8",
            got=str(path),
            remedy="Save it as UTF-8, as editors offer. To see what a session's log holds use isiw show, to continue "
            "the session isiw resume.",
        ) from error
    except (ValueError, RecursionError) as error:  # not TOML, or nested without end
        raise ConfigError(f"{path} is not valid TOML: {error}", remedy="Correct the line that it names.") from error


def checked(kind: type[_T], values: Mapping[str, Any], source: str) -> _T:
    """Values as an instance of a pydantic model or a dataclass."""
    try:
        return cast("_T", dict(_strict(cast("type", kind)).model_validate({"values": values}))["values"])
    except ValidationError as error:
        raise _explained(kind, first_to_tell(error.errors()), source) from error


@cache
def _strict(kind: type) -> type[BaseModel]:
    """A model around the kind: dataclasses take from it that unknown keys are an error."""
    return create_model("Strict", __config__=ConfigDict(extra="forbid"), values=(kind, ...))


def _explained(kind: Any, error: ErrorDetails, source: str) -> ConfigError:
    _, *path = error["loc"]
    key = ".".join(str(part) for part in path)
    if error["type"] in UNKNOWN:
        known = known_keys(kind, path[:-1])
        where = f"Settings go into [{'.'.join(map(str, [*path[:-1], 'settings']))}]." if "settings" in known else ""
        return ConfigError(
            f"{source}: the key {key} is unknown",
            got=error["input"],
            expected=f"one of {', '.join(known)}",
            remedy=_sentences(meant_instead(error, known), where, "Correct it or remove it."),
        )
    if error["type"] == "missing":
        return ConfigError(f"{source}: the key {key} is missing", remedy="Add it.")
    what = f"{source}: the value of {key} cannot be used" if key else f"{source} cannot be used"
    remedy = "Correct it, or remove the key for its default."
    own = error.get("ctx", {}).get("error")
    if isinstance(own, IsiwError):
        return ConfigError(f"{what}: {own.what}", got=own.got, expected=own.expected, remedy=own.remedy or remedy)
    remedy = _sentences(meant_instead(error), remedy)
    return ConfigError(what, got=error["input"], expected=expected_instead(error), remedy=remedy)


def _sentences(*sentences: str) -> str:
    return " ".join(filter(None, sentences))
