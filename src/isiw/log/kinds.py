"""What a log is of, and how to look at one that is of something else than is wanted."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path

from isiw.errors import LogError
from isiw.log.schema import Header
from isiw.text.commands import command

__all__ = ["LogKind", "kind_of", "of_another_kind"]


class LogKind(StrEnum):
    """What a log is of, as it is called in a sentence."""

    SEARCH = "a search for a window"
    THRESHOLD = "a search for a motor threshold"
    PRODUCTION = "an interval production task"

    def shown_by(self, path: Path) -> str:
        """The command that shows a log of this kind.

        Args:
            path: the log.
        """
        match self:
            case LogKind.SEARCH:
                return command("show", path)
            case LogKind.THRESHOLD:
                return command("threshold", path, "--show")
            case LogKind.PRODUCTION:
                return command("interval", path, "--show")


def kind_of(header: Header) -> LogKind:
    """What a log is of in which stimuli are given.

    Args:
        header: the log's.
    """
    return LogKind.SEARCH if header.intensities is None else LogKind.THRESHOLD


def of_another_kind(path: Path, kind: LogKind, wanted: LogKind) -> LogError:
    """The error where a log is of something else than is wanted.

    Args:
        path: the log.
        kind: what it is of.
        wanted: what it should be of.
    """
    return LogError(
        f"the log is of {kind}, not of {wanted}", got=str(path), remedy=f"Look at it with: {kind.shown_by(path)}"
    )
