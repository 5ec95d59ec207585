"""What an operator, or isiw, says of trials afterwards, as an event to append; what makes no sense is refused."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from isiw.change import MOST_NOTED
from isiw.checks import text, whole
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.findings import Finding, Kind, Severity
from isiw.log.schema import Correction, Event, EventKind
from isiw.log.verdicts import CHANGE, VERDICTS, changed_after, doubted_by
from isiw.signals.plausible import doubtful_from, implausible_amplitude, is_far
from isiw.trials import Trial, TrialTable

LOOKED_AT: Final = "Rejected by the operator after looking at the MEP."
"""The reason of an exclusion that rejects an MEP."""

MANY_CHANGES: Final = Finding(
    Kind.MANY_CHANGES,
    Severity.DOUBT,
    f"{MOST_NOTED} changes were noted, and no more are learnt in a session",
    "Further ones are in the log as remarks. If the coil or the gain changes all the time, what is measured says "
    "little about a window: end the session, find out why, and begin another.",
)

_KEPT: Final = "It remains a mistrial; its waveforms, if any, stay in the log."


def newly_doubted(trials: TrialTable, events: Iterable[Event], space: DesignSpace) -> list[Trial]:
    """The trials whose realised ISIs are in doubt now; none once ISIs were confirmed, nor any that were judged."""
    judged = [event for event in events if event.kind in VERDICTS and event.finding is Kind.ISIS_FAR]
    if any(event.kind == "inclusion" for event in judged):
        return []
    seen = {event.trial for event in judged}
    asked = [
        (trial, is_far(trial.isi_error_ms, space, trial.isi_sd_ms))
        for trial in trials
        if trial.told and trial.index not in seen and trial.isi_error_ms is not None
    ]
    first = doubtful_from([far for _, far in asked])
    return [] if first is None else [trial for trial, _ in asked[first:]]


def isi_doubted(trial: Trial) -> Event:
    """That a trial does not count, as its realised ISI is in doubt."""
    text = f"Realised ISI in doubt: {trial.isi_ms:g} ms instead of {trial.commanded_isi_ms:g} ms."
    return Event(kind="exclusion", trial=trial.index, text=text, finding=Kind.ISIS_FAR)


def isi_confirmed(number: int) -> Event:
    """That a trial counts whose realised ISI was in doubt, as it was confirmed."""
    return Event(kind="inclusion", trial=number, text="The realised ISI was confirmed.", finding=Kind.ISIS_FAR)


class KeyTakenError(InvalidValueError):
    """A key that is that of something else in a log."""


def is_logged(event: Event, events: Iterable[Event]) -> bool:
    """True if an event was logged with its key before; raise KeyTakenError if something else has the key."""
    before = next((each for each in events if event.key is not None and each.key == event.key), None)
    if before is None:
        return False
    texts = {event.text, f"{event.text} (key {event.key})"}  # as older logs have it
    was, is_now = (CHANGE if each.finding is Kind.MANY_CHANGES else each.kind for each in (before, event))
    other_trial = event.kind in VERDICTS and before.trial != event.trial
    if was != is_now or before.text not in texts or other_trial:
        raise KeyTakenError(
            f"the key {event.key!r} is that of something else in this log",
            got=_said(event, is_now),
            expected=_said(before, was),
            remedy="Nothing was logged. Give each note, change, exclusion and inclusion a key of its own.",
        )
    return True


def _said(event: Event, kind: EventKind) -> str:
    return f"{kind}{f' of trial {event.trial}' if kind in VERDICTS else ''}: {event.text}"


def exclusion(
    trials: TrialTable, number: int, reason: str = "", key: str | None = None, events: Iterable[Event] = ()
) -> Event:
    """That a trial does not count from here on; what was logged with its key before may be said whatever came since.

    By the events so far it may be one that is in doubt. With a key, a trial that is excluded already may be excluded: a
    repetition of that must not do it later.
    """
    number, reason = whole("the number of a trial", number), text("the reason of an exclusion", reason)
    text("the key of an exclusion", "" if key is None else key)
    event = Event.model_construct(kind="exclusion", trial=number, text=reason, key=key)  # its number is checked below
    if not is_logged(event, events):
        possible = {trial.index for trial in trials if trial.counts or (key is not None and trial.excluded)}
        _require("exclude", number, sorted(possible | {*doubted_by(events)}), "that counts")
    return event


def inclusion(trials: TrialTable, number: int, key: str | None = None, events: Iterable[Event] = ()) -> Event:
    """That a trial that was excluded counts again; a key is as for `exclusion`."""
    number = whole("the number of a trial", number)
    text("the key of an inclusion", "" if key is None else key)
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
    text("the key of a change", "" if key is None else key)
    return Event(kind=CHANGE, trial=trials[-1].index if trials else None, text=text("a change", what), key=key)


def or_remark(noted: Event, events: Iterable[Event], *, already: bool) -> Event:
    """A change as it is logged: a remark once `MOST_NOTED` were noted at other trials; one may be known already."""
    before = set(changed_after(events))
    if noted.trial is None or noted.trial in before or len(before) + already < MOST_NOTED:
        return noted
    return noted.model_copy(update={"kind": "note", "finding": Kind.MANY_CHANGES})


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
