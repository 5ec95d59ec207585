"""The kinds of logs, and the commands that show and continue one of each."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Final

from isiw.errors import LogError
from isiw.log.headers import AnyHeader
from isiw.text.sanitize import command


class LogKind(StrEnum):
    """The kind of a log, as a sentence names it."""

    SEARCH = "a search for a window"
    THRESHOLD = "a search for a motor threshold"
    PRODUCTION = "an interval production task"
    INTERVENTION = "an intervention"
    IMPORTED = "trials that were delivered without isiw"

    def shown_by(self, path: Path) -> str:
        """The command that shows a log of this kind."""
        return command(_OWN_COMMAND[self], path, "--show") if self in _OWN_COMMAND else command("show", path)

    def continued_by(self, path: Path) -> str:
        """The command that continues a log of this kind."""
        if self in _OWN_COMMAND:
            return command(_OWN_COMMAND[self], path, "--resume")
        imported = self is LogKind.IMPORTED
        return command("run", "CONFIG", "--earlier", path) if imported else command("resume", path)


_OWN_COMMAND: Final = {LogKind.THRESHOLD: "threshold", LogKind.PRODUCTION: "interval"}
"""Commands that show and continue logs of one kind."""

_OF_TAG: Final = {
    "session": LogKind.SEARCH,
    "threshold": LogKind.THRESHOLD,
    "production": LogKind.PRODUCTION,
    "imported": LogKind.IMPORTED,
    "intervention": LogKind.INTERVENTION,
}


def kind_of(header: AnyHeader) -> LogKind:
    """The kind of a log."""
    return _OF_TAG[header.kind]


def of_another_kind(path: Path, kind: LogKind, wanted: LogKind) -> LogError:
    """The error if a log is of something else than is wanted."""
    return LogError(
        f"the log is of {kind}, not of {wanted}", got=str(path), remedy=f"Look at it with: {kind.shown_by(path)}"
    )
