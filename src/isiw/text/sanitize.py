"""Text from elsewhere without what a terminal, a page or a picture would obey; values and commands in few words."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import unicodedata
from typing import Final

LONGEST: Final = 80


def shown(value: object) -> str:
    """The beginning of what a value prints as, and its type, such as "0.12 (float)"; None is None."""
    if value is None:
        return "None"
    try:
        text = one_line(repr(value))
    except Exception:  # noqa: BLE001 - an object of somebody else's may fail in any way
        return f"an object of the type {type(value).__name__}"
    return f"{text if len(text) <= LONGEST else f'{text[:LONGEST]}…'} ({type(value).__name__})"


def command(*words: object) -> str:
    """A command of isiw, its words quoted as this system's shell needs it."""
    line = ["isiw", *map(str, words)]
    return subprocess.list2cmdline(line) if os.name == "nt" else shlex.join(line)


_SEQUENCES: Final = re.compile(
    r"(?:\x1b[\]PX^_]|[\x9d\x90\x98\x9e\x9f]).*?(?:\x07|\x1b\\|\x9c|$)"  # titles, links, and what a device is told
    r"|(?:\x1b\[|\x9b)[0-?]*[ -/]*[@-~]?"  # colours, and moves of the cursor
    r"|\x1b[ -/]*[0-~]?",
    re.DOTALL,
)
_OBEYED: Final = frozenset({"Cc", "Cf", "Cs", "Co"})
"""Unicode's categories of control characters, invisible ones that turn the direction of reading, and surrogates."""


def plain(text: str) -> str:
    """A text without escape sequences and invisible characters; newlines and tabs stay."""
    return "".join(map(_plain, _SEQUENCES.sub("", text)))


def one_line(text: str) -> str:
    """The same on one line, with single spaces."""
    return " ".join(plain(text).split())


def _plain(character: str) -> str:
    if character in "\n\t":
        return character
    category = unicodedata.category(character)
    return "" if category in _OBEYED else "\n" if category in ("Zl", "Zp") else character


_WHOLE: Final = re.compile(r"[0-9]{1,18}")


def read_whole(text: str) -> int | None:
    """The whole number that a text is, in ASCII digits without a sign; None if it is none."""
    return int(text) if _WHOLE.fullmatch(text) else None


def counted(count: int, one: str, several: str | None = None) -> str:
    """A number of things in words, such as "1 session" and "2 sessions"."""
    return f"{count} {one if count == 1 else several or f'{one}s'}"
