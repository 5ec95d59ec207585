"""The questions that people ask of a session first, each with a short answer and what it rests on."""

from __future__ import annotations

import statistics
from collections import Counter
from typing import Final, NamedTuple

from isiw.log.reader import SessionRecord
from isiw.log.schema import Event, EventKind
from isiw.report.words import counts_sentence
from isiw.trials import MistrialReason, Trial

__all__ = ["Answer", "answers"]

_OF_TIMING: Final = frozenset(
    {MistrialReason.NO_IMPACT, MistrialReason.NO_PULSE, MistrialReason.TMS_BEFORE_IMPACT, MistrialReason.ISI_OFF}
)
_ENDING: Final[frozenset[EventKind]] = frozenset({"limit", "fault", "pause", "doubt"})


class Answer(NamedTuple):
    """A question, its answer in a few words, and what that rests on."""

    question: str
    answer: str
    detail: str


def answers(record: SessionRecord) -> list[Answer]:
    """Which trials were lost, whether timing was right, whether the muscle was at rest, and why the session stopped.

    Args:
        record: the session.
    """
    return [_lost(record), _timing(record), _rest(record), _stopped(record)]


def _lost(record: SessionRecord) -> Answer:
    given = len(record.table) + len(record.unknown)
    counting = len(record.table.told)
    return Answer("Which trials were lost, and why?", f"{counting} of {given} count", counts_sentence(record))


def _timing(record: SessionRecord) -> Answer:
    question = "Was the timing right?"
    errors_ms = [abs(trial.isi_error_ms) for trial in record.table.told if trial.isi_error_ms is not None]
    lost = _count_lost(record, _OF_TIMING)
    if not errors_ms:
        return Answer(question, "not known", f"No trial that counts has a realised ISI. {lost}")
    if not any(errors_ms) and not any(_is_timed(trial) for trial in record.table):
        return Answer(
            question,
            "as the device says",
            f"It reports every ISI as it was wanted, and no time of a pulse or a hit to check that by. {lost}",
        )
    middle_ms, largest_ms = statistics.median(errors_ms), max(errors_ms)
    tolerance_ms = record.header.signals.isi_tolerance_ms or record.header.space.tolerance_ms
    detail = f"At most {largest_ms:.1f} ms off in a trial that counts; {tolerance_ms:g} ms are tolerated. {lost}"
    return Answer(question, f"off by {middle_ms:.1f} ms (median)", detail)


def _is_timed(trial: Trial) -> bool:
    return trial.t_hit_ms is not None or trial.t_tms_ms is not None


def _rest(record: SessionRecord) -> Answer:
    question, limit_uv = "Was the muscle at rest?", record.header.signals.background_uv
    levels_uv = [t.background_rms_uv for t in record.table if t.background_rms_uv is not None]
    counting_uv = [t.background_rms_uv for t in record.table if t.counts and t.background_rms_uv is not None]
    lost = _count_lost(record, frozenset({MistrialReason.BACKGROUND_ACTIVITY}))
    if not levels_uv:
        return Answer(question, "not known", f"The log has no background EMG. {lost}")
    worst = f"at most {max(counting_uv):.2g} µV in a trial that counts, " if counting_uv else ""
    detail = f"EMG before the pulse: {worst}{limit_uv:g} µV are allowed. {lost}"
    return Answer(question, f"{statistics.median(levels_uv):.2g} µV RMS (median)", detail)


def _count_lost(record: SessionRecord, reasons: frozenset[MistrialReason]) -> str:
    counts = Counter(str(trial.reason) for trial in record.table if trial.reason in reasons)
    listed = ", ".join(f"{count} {reason}" for reason, count in counts.items())
    return f"Lost for this: {listed}." if counts else "No trial was lost for this."


def _stopped(record: SessionRecord) -> Answer:
    question = "Why did it stop?"
    decision, ending = record.decision, _ending(record)
    if decision is None:
        return Answer(question, "before the first estimate", ending)
    if decision.stop:
        return Answer(question, "it ended", f"{decision.reason} {ending}".strip())
    answer = "it has not stopped" if not ending else "it was interrupted"
    return Answer(question, answer, f"{ending} {decision.reason}".strip())


def _ending(record: SessionRecord) -> str:
    """What happened after the last estimate that can end a session, in the log's words."""
    after = record.history
    if record.estimates:
        after = after[after.index(record.estimates[-1]) + 1 :]
    return " ".join(entry.text for entry in after if isinstance(entry, Event) and entry.kind in _ENDING)
