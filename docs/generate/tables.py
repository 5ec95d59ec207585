"""Tables in Markdown, and what docstrings say of arguments."""

from __future__ import annotations

import re
from collections.abc import Sequence

import docstring_parser


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table."""
    lines = [list(heads), ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def cell(text: object) -> str:
    """Text for one cell."""
    return re.sub(r"\s+", " ", str(text)).replace("|", "\\|").replace("<", "&lt;").strip()


def code(value: object) -> str:
    """A value as it is typed."""
    return f"`{value}`".replace("|", "\\|")


def arguments(thing: object) -> dict[str, str]:
    """What the docstring says of each argument or field."""
    return {one.arg_name: one.description or "" for one in docstring_parser.parse(thing.__doc__ or "").params}


def sentence(thing: object) -> str:
    """What the docstring says first."""
    return docstring_parser.parse(thing.__doc__ or "").short_description or ""
