"""Codes of people: spellings of one code are taken for one person, whose stimuli must not count as two people's."""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from mcap import records as mcap
from mcap.stream_reader import StreamReader

from isiw.errors import InvalidValueError
from isiw.log.blocks import UNREADABLE
from isiw.log.headers import AnyHeader, ProductionHeader
from isiw.log.schema import CONFIGURATION
from isiw.opening import opened
from isiw.text.sanitize import plain


def spelling(code: str) -> str:
    """What a code has in common with its other spellings: letters and digits, whatever their case."""
    return re.sub(r"[\s_-]", "", unicodedata.normalize("NFKC", code)).casefold()


def is_same_person(one: str, other: str) -> bool:
    """True if two codes are of one person, or may be."""
    return bool(one) and spelling(one) == spelling(other)


def require_one_spelling(folder: Path, header: AnyHeader) -> None:
    """Raise if a log in the folder has another spelling of the code of the person whose log is to begin there."""
    if isinstance(header, ProductionHeader) or header.device.simulated:
        return
    for log, code in _codes(folder):
        if code != header.subject and is_same_person(code, header.subject):
            raise InvalidValueError(
                "the person's code differs from another log's only in case, spaces, hyphens or underscores",
                got=header.subject,
                expected=f"{plain(code)}, as in {log}",
                remedy=f"For the same person give the code {plain(code)}; for another, one that differs in more.",
            )


def _codes(folder: Path) -> Iterator[tuple[Path, str]]:
    """The logs of people in a folder, and the code of each."""
    with suppress(OSError):  # there is no folder yet
        for file in sorted(file for file in folder.iterdir() if file.is_file()):
            if (code := _code(file)) is not None:
                yield file, code


def _code(file: Path) -> str | None:
    """The code in the header that a log begins with, before its blocks; None of nobody, and if it cannot be read."""
    with suppress(OSError, ValueError, LookupError, TypeError, *UNREADABLE), opened(file) as log:
        for record in StreamReader(log, emit_chunks=True).records:
            if isinstance(record, mcap.Attachment) and record.name == CONFIGURATION:
                header = tomllib.loads(record.data.decode())
                return None if header["device"]["simulated"] else str(header["subject"])
            if isinstance(record, mcap.Chunk):
                return None
    return None
