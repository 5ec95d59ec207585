"""Trials as they count after an operator's verdicts: events that were appended; no trial's own record changes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from typing import Final

from isiw.findings import Kind
from isiw.log.schema import Correction, Event, EventKind
from isiw.trials import Trial, TrialTable

VERDICTS: Final[dict[EventKind, Callable[[Trial, Event], Trial]]] = {
    "exclusion": lambda trial, _: dataclasses.replace(trial, excluded=True),
    "inclusion": lambda trial, _: dataclasses.replace(trial, excluded=False),
    "acceptance": lambda trial, _: trial.accepted_anyway(),
    "correction": lambda trial, event: dataclasses.replace(
        trial, **(event.corrected or Correction()).model_dump(exclude_none=True)
    ),
}
"""The effect of each kind of verdict on a trial."""

CHANGE: Final[EventKind] = "change"


def under(trial: Trial, event: Event) -> Trial:
    """A trial as it counts after an event; the same if the event says nothing about it."""
    verdict = VERDICTS.get(event.kind)
    return trial if verdict is None or event.trial != trial.index else verdict(trial, event)


def under_all(trials: TrialTable, events: Iterable[Event]) -> TrialTable:
    """All trials as they count after some events, in the order in which these happened."""
    for event in events:
        if event.kind in VERDICTS:
            trials = trials.changed(lambda trial, event=event: under(trial, event))  # type: ignore[misc]
    return trials


def excluded_by(events: Iterable[Event]) -> list[int]:
    """The trials that some events leave excluded, the one that was excluded last at the end."""
    return [number for number, event in _last_verdicts(events).items() if event.kind == "exclusion"]


def doubted_by(events: Iterable[Event]) -> list[int]:
    """The trials that are excluded since their realised ISIs are in doubt, which nobody has confirmed or judged."""
    return [
        number
        for number, event in _last_verdicts(events).items()
        if event.kind == "exclusion" and event.finding is Kind.ISIS_FAR
    ]


def _last_verdicts(events: Iterable[Event]) -> dict[int, Event]:
    """The last verdict on each trial that says whether it counts, in the order in which they were given."""
    last: dict[int, Event] = {}
    for event in events:
        if event.kind in VERDICTS and event.kind != "correction" and event.trial is not None:
            last.pop(event.trial, None)
            last[event.trial] = event
    return last


def changed_after(events: Iterable[Event]) -> list[int]:
    """The trials after which a change was noted, each once."""
    return list(dict.fromkeys(event.trial for event in events if event.kind == CHANGE and event.trial is not None))
