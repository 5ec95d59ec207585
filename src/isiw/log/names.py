"""Whether a log can begin, or continue, at a path: what it can be called, and what may have its name already."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import IO, Final, cast

from isiw.errors import LogError
from isiw.files import in_the_way, is_reserved, twin
from isiw.log.continuing import continued_by
from isiw.log.durable import claimed
from isiw.log.headers import AnyHeader
from isiw.log.places import Fingerprint, log_of, part_of
from isiw.log.salvage import Salvage, holds, salvage_file
from isiw.log.schema import decode

COPYING: Final = ".resuming"
"""The ending of a log's copy until it takes the log's place."""


def require_free(target: Path) -> None:
    """Raise LogError if no log can begin at a path: its name is none for a log, or something has it already."""
    _require_short(target)
    if target != log_of(target) or target.suffix == COPYING:
        raise LogError(
            "a log cannot have this name", got=str(target), remedy="Name a file; .part is added while the session runs."
        )
    if is_reserved(target.name):
        raise LogError(
            "a log cannot have this name, which Windows keeps for itself",
            got=str(target),
            remedy="Choose another name, without a full stop or a space at its end.",
        )
    for existing in (target, part_of(target)):
        if (other := in_the_way(existing)) is not None:
            raise LogError(f"no log can be here: there is {other}", got=str(existing), remedy="Choose another path.")
        if existing.exists():
            raise LogError(
                "there is a log already, and it is never overwritten", got=str(existing), remedy=_way_on(existing)
            )
        if (same := twin(existing)) is not None:
            raise LogError(
                "on other systems the log would be the same file as another one",
                got=f"{target}, beside {same.name}",
                expected="a name that differs in more than capitals and the spelling of accents",
                remedy="Choose another name, or a folder of its own.",
            )


_USUAL_LONGEST: Final = 255


def _require_short(target: Path) -> None:
    """Raise if a log's name is too long, or too long to be resumed: a copy has a longer one for that moment."""
    try:
        most = os.pathconf(target.parent, "PC_NAME_MAX") if hasattr(os, "pathconf") else _USUAL_LONGEST
    except OSError:  # no such folder yet
        most = _USUAL_LONGEST
    most -= len(COPYING)
    if (size := len(os.fsencode(target.name))) > most:
        raise LogError(
            "the log's name is too long",
            got=f"{size} bytes: {target}",
            expected=f"at most {most} bytes",
            remedy="Choose a shorter name.",
        )


def _way_on(existing: Path) -> str:
    """The remedy for a file that is in the way; only what can be resumed is suggested to be resumed."""
    try:
        found = salvage_file(existing)
    except LogError:
        return "Choose another path; this is not a log that can be continued."
    for message in reversed(found.messages):
        if message.topic in {"/header", "/production_header"}:
            with suppress(ValueError):
                header = cast("AnyHeader", decode(message.topic, message.data))
                return f"Choose another path, or continue it: {continued_by(log_of(existing), header)}"
    return "Choose another path; nothing of this log can be continued."


def require_unchanged(source: IO[bytes], salvage: Salvage) -> None:
    """Raise if a file is no longer the one that was salvaged."""
    there = None
    with suppress(FileNotFoundError):  # of a session that has just finished it, which may be between any two calls
        there = Fingerprint.of(salvage.path)
    if not Fingerprint.of(source) == salvage.fingerprint == there:
        raise LogError(
            "the log has changed since it was read", got=str(salvage.path), remedy="Begin again by reading it."
        )


def own_file(target: Path, salvage: Salvage) -> Fingerprint | None:
    """The file at a log's final name, which its continuation may replace; None if there is none."""
    if salvage.path == target:
        if part_of(target).exists():
            with claimed(part_of(target)):  # which raises if a session writes to it
                raise _foreign(part_of(target), salvage)
        return salvage.fingerprint
    if not target.exists():
        return None
    try:
        earlier = salvage_file(target)
    except LogError as error:
        raise _foreign(target, salvage) from error
    if not holds(salvage, earlier):
        raise _foreign(target, salvage)
    return earlier.fingerprint


def _foreign(path: Path, salvage: Salvage) -> LogError:
    return LogError(
        "another session's file is where this log would be, and it is never replaced",
        got=str(path),
        remedy=f"Give {salvage.path.name} or {path.name} another name or folder, and continue from there.",
    )
