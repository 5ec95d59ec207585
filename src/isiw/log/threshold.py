"""Reading the log of a search for the motor threshold."""

from __future__ import annotations

from pathlib import Path

from isiw.log.kinds import LogKind
from isiw.log.reader import SessionRecord, read_salvaged
from isiw.log.salvage import Salvage, salvage
from isiw.log.schema import PulseOutcome

__all__ = ["outcomes", "pulses_given", "read_threshold", "read_threshold_salvaged"]


def read_threshold(path: str | Path) -> SessionRecord:
    """Read the log of a search for the motor threshold, finished or not, whole or damaged.

    Args:
        path: the log, with or without `.part`.

    Raises:
        LogError: no such file, not a log, or one of something else.
        DamagedLogError: a log of which not even the header can be read.
    """
    return read_threshold_salvaged(salvage(path))


def read_threshold_salvaged(salvaged: Salvage) -> SessionRecord:
    """The search for the motor threshold in what was salvaged from a log.

    Args:
        salvaged: what was read.

    Raises:
        LogError: the log is of something else.
    """
    return read_salvaged(salvaged, LogKind.THRESHOLD)


def outcomes(record: SessionRecord) -> tuple[PulseOutcome, ...]:
    """What came of each pulse, as it counts after what an operator said about it.

    Args:
        record: the log.
    """
    excluded = {event.trial: event.text for event in record.events if event.kind == "exclusion"}
    found = [entry for entry in record.history if isinstance(entry, PulseOutcome)]
    return tuple(
        each.model_copy(update={"reason": excluded[each.trial]}) if each.trial in excluded else each for each in found
    )


def pulses_given(record: SessionRecord) -> int:
    """How many pulses were given, or may have been; those that an operator left without giving them do not count.

    Args:
        record: the log.
    """
    return len({intent.trial for intent in record.unknown} | {outcome.trial for outcome in outcomes(record)})
