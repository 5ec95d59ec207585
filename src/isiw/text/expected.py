"""What pydantic finds wrong with a value, in the words of who wrote it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, Final, get_args, get_type_hints

from pydantic_core import ErrorDetails

from isiw.errors import did_you_mean

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
    """What should have been there, for after "expected"."""
    kind, _, fault = error["type"].partition("_")
    if kind in _KINDS and fault in {"type", "parsing", "from_float", "attributes_type"}:
        return _KINDS[kind]
    return error["msg"].removeprefix("Input should be ")


def meant_instead(error: ErrorDetails, keys: Sequence[str] = ()) -> str:
    """What was probably meant, as a question; empty where nothing that there is comes near."""
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
    return sorted(f.name for f in fields(kind)) if is_dataclass(kind) else sorted(kind.model_fields)
