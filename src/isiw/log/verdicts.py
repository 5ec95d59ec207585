"""An operator's verdict on a trial afterwards: an event that is appended; the trial's own record stays as it was."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from typing import Final

from isiw.checks import text, whole
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.findings import Kind
from isiw.log.schema import Correction, Event, EventKind
from isiw.signals.limits import implausible_amplitude
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

LOOKED_AT: Final = "Rejected by the operator after looking at the MEP."
"""The reason of an exclusion that rejects an MEP."""

_KEPT: Final = "It remains a mistrial; its waveforms, if any, stay in the log."


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
    excluded: list[int] = []
    for event in events:
        if event.kind in VERDICTS and event.kind != "correction" and event.trial is not None:
            excluded = [number for number in excluded if number != event.trial]
            if event.kind == "exclusion":
                excluded.append(event.trial)
    return excluded


class KeyTakenError(InvalidValueError):
    """A key that is that of something else in a log."""


def is_logged(event: Event, events: Iterable[Event]) -> bool:
    """True if an event was logged with its key before; raise KeyTakenError if something else has the key."""
    before = next((each for each in events if event.key is not None and each.key == event.key), None)
    if before is None:
        return False
    texts = {event.text, f"{event.text} (key {event.key})"}  # as older logs have it
    other_trial = event.kind in VERDICTS and before.trial != event.trial
    if before.kind != event.kind or before.text not in texts or other_trial:
        raise KeyTakenError(
            f"the key {event.key!r} is that of something else in this log",
            got=_said(event),
            expected=_said(before),
            remedy="Nothing was logged. Give each note, change, exclusion and inclusion a key of its own.",
        )
    return True


def _said(event: Event) -> str:
    return f"{event.kind}{f' of trial {event.trial}' if event.kind in VERDICTS else ''}: {event.text}"


def exclusion(
    trials: TrialTable, number: int, reason: str = "", key: str | None = None, events: Iterable[Event] = ()
) -> Event:
    """That a trial does not count from here on; what was logged with its key before may be said whatever came since.

    With a key, a trial that is excluded already may be excluded: a repetition of that must not do it later.
    """
    number, reason = whole("the number of a trial", number), text("the reason of an exclusion", reason)
    text("the key of an exclusion", key or "")
    event = Event.model_construct(kind="exclusion", trial=number, text=reason, key=key)  # its number is checked below
    if not is_logged(event, events):
        possible = [trial.index for trial in trials if trial.counts or (key is not None and trial.excluded)]
        _require("exclude", number, possible, "that counts")
    return event


def inclusion(trials: TrialTable, number: int, key: str | None = None, events: Iterable[Event] = ()) -> Event:
    """That a trial that was excluded counts again; a key is as for `exclusion`."""
    number = whole("the number of a trial", number)
    text("the key of an inclusion", key or "")
    event = Event.model_construct(kind="inclusion", trial=number, text="Included again by the operator.", key=key)
    if not is_logged(event, events):
        possible = [trial.index for trial in trials if trial.excluded or (key is not None and trial.counts)]
        _require("include", number, possible, "that is excluded")
    return event


def acceptance(trials: TrialTable, number: int, space: DesignSpace) -> Event:
    """That a mistrial counts all the same, or a trial that was excluded counts again."""
    trial = next((trial for trial in trials if trial.index == number), None)
    if trial is not None and trial.excluded:
        return inclusion(trials, number)
    _require("accept", number, [trial.index for trial in trials if not trial.counts], "that does not count")
    at_ms = None if trial is None else trial.isi_ms
    placed = trial is not None and (trial.commanded_isi_ms is None or (at_ms is not None and space.admits(at_ms)))
    if trial is None or trial.mep_mv is None or not placed:
        raise InvalidValueError(
            f"trial {number} cannot be accepted: no MEP was measured at an ISI that a strategy could learn from",
            got=None if trial is None else str(trial.reason),
            remedy=_KEPT,
        )
    if (slip := implausible_amplitude(trial.mep_mv)) is not None:  # whatever a person thinks of the trial
        raise InvalidValueError(
            f"trial {number} cannot be accepted: {slip.text}", got=trial.mep_mv, remedy=f"{slip.remedy} {_KEPT}"
        )
    if trial.mep_mv == 0 and trial.reason is Kind.IMPLAUSIBLE:
        raise InvalidValueError(
            f"trial {number} cannot be accepted: its EMG does not move in the MEP window",
            got=trial.mep_mv,
            remedy=f"Is the amplifier on? {_KEPT}",
        )
    return Event(kind="acceptance", trial=number, text=f"Accepted by the operator all the same: {trial.reason}.")


def change(trials: TrialTable, what: str, key: str | None = None) -> Event:
    """That something changed after the last trial that may bear on all later MEPs; trials count as they did."""
    text("the key of a change", key or "")
    return Event(kind="change", trial=trials[-1].index if trials else None, text=text("a change", what), key=key)


def correction(trials: TrialTable, number: int, why: str, corrected: Correction) -> Event:
    """That some values of a trial were others than its record says; the record stays as it is."""
    _require("correct", number, [trial.index for trial in trials], "of this session")
    why = text("the reason of a correction", why)
    return Event(kind="correction", trial=number, text=why, corrected=corrected)


def _require(verb: str, number: int, possible: list[int], which: str) -> None:
    if whole("the number of a trial", number) not in possible:
        raise InvalidValueError(
            f"cannot {verb} this trial",
            got=number,
            expected=f"a trial {which}: {', '.join(map(str, possible)) or 'none'}",
        )
