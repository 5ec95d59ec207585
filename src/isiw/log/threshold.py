"""A search for the motor threshold as its log tells it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from isiw.log.headers import ThresholdHeader, require_read
from isiw.log.records import unknown_of
from isiw.log.schema import Event, Intent, PulseOutcome, Record


@dataclass(frozen=True, eq=False)
class ThresholdRecord:
    """A search for the motor threshold.

    Args:
        path: the file that was read.
        header: what the search is.
        history: intents, outcomes, beliefs and events, in the order in which they were logged.
        losses: what could not be read, a sentence each; empty if the log is whole.
        finished: whether the search closed its log.
        end_lost: whether its end is missing, so that nobody knows how many pulses it told of.
        delivered: how many pulses were given by its index, or may have been.
        unread: parts of the header that this version cannot read, and why.
    """

    path: Path
    header: ThresholdHeader
    history: tuple[Record, ...] = field(repr=False)
    losses: tuple[str, ...]
    finished: bool
    end_lost: bool
    delivered: int
    unread: Mapping[str, str]

    def require_read(self, *parts: str) -> None:
        """As `SessionRecord.require_read`."""
        require_read(self.path, self.unread, parts)

    @cached_property
    def outcomes(self) -> tuple[PulseOutcome, ...]:
        """What came of each pulse, as it counts after what an operator said about it."""
        excluded = {
            event.trial: event.text for event in self.history if isinstance(event, Event) and event.kind == "exclusion"
        }
        return tuple(
            each.model_copy(update={"reason": excluded[each.trial]}) if each.trial in excluded else each
            for each in self.history
            if isinstance(each, PulseOutcome)
        )

    @property
    def intents(self) -> tuple[Intent, ...]:
        """What was about to be given."""
        return tuple(record for record in self.history if isinstance(record, Intent))

    @property
    def unknown(self) -> tuple[Intent, ...]:
        """Pulses that were given, or may have been, and whose outcome is not in the log."""
        return unknown_of(self.history, {outcome.trial for outcome in self.outcomes}, self.delivered)

    @property
    def given(self) -> int:
        """How many pulses were given, or may have been; one that an operator has withdrawn does not count."""
        return len(self.outcomes) + len(self.unknown)
