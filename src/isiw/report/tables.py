"""The tables of a report: trials, what was lost, events, and what was counted for safety."""

from __future__ import annotations

from collections import Counter
from itertools import groupby, pairwise
from typing import NamedTuple

from isiw.findings import Kind
from isiw.log.reader import SessionRecord
from isiw.log.schema import Event, Intent
from isiw.sentences import asked, outcome
from isiw.text.stimuli import TAP, StimulusWords
from isiw.trials import Trial


class TrialRow(NamedTuple):
    """A trial in words."""

    trial: int
    asked: str
    realised: str
    outcome: str
    background: str
    remark: str


class Counted(NamedTuple):
    """Something that was counted, and what it may be at most or at least."""

    what: str
    found: str
    limit: str


def trial_row(trial: Trial, first: StimulusWords = TAP) -> TrialRow:
    """One trial of the table of all trials."""
    return TrialRow(
        trial.index,
        asked(trial, first),
        "–" if trial.isi_ms is None else f"{trial.isi_ms:.1f} ms",
        outcome(trial),
        "–" if trial.background_rms_uv is None else f"{trial.background_rms_uv:.2g} µV",
        _remark(trial, first),
    )


def _remark(trial: Trial, first: StimulusWords) -> str:
    if trial.overruled is not None:
        return f"accepted by the operator; had been: {trial.overruled}"
    if trial.reason is not None and trial.mep_mv is not None:
        return f"{1e3 * trial.mep_mv:.0f} µV were measured"
    return f"nothing is learnt from {first.one} alone" if trial.tap_alone and trial.counts else ""


def lost_rows(record: SessionRecord) -> list[tuple[int, str, str]]:
    """Trials that do not count: number, what was asked, and why; those of unknown outcome too."""
    said = {event.trial: event.text for event in record.events if event.kind == "exclusion"}
    lost = [trial for trial in (*record.table, *record.unknown_trials) if not trial.counts]
    return sorted((t.index, asked(t, record.header.stimulus), _why(t, said.get(t.index, ""))) for t in lost)


def _why(trial: Trial, said: str) -> str:
    return str(trial.reason) if trial.reason is not None else f"excluded by the operator: {said}".rstrip(": ")


def event_rows(record: SessionRecord) -> list[tuple[str, str, str]]:
    """Events in the order in which they were logged: the trial before or about which, the kind, and the text."""
    return [("–" if event.trial is None else str(event.trial), event.kind, event.text) for event in record.events]


def counted_rows(record: SessionRecord) -> list[Counted]:
    """What was delivered against what the limits allow."""
    limits, kinds = record.header.limits, Counter(event.kind for event in record.events)
    wanted_ms = [trial.commanded_isi_ms for trial in record.table] + [intent.isi_ms for intent in record.unknown]
    isis_ms = [isi_ms for isi_ms in wanted_ms if isi_ms is not None]
    asked_ms = f"{min(isis_ms):g}–{max(isis_ms):g} ms" if isis_ms else "–"
    kept = "limits" not in record.unread
    unknown = sum(trial.reason is Kind.OUTCOME_UNKNOWN for trial in record.table) + len(record.unknown)
    shortest_s = _shortest_s(record)
    return [
        Counted("stimuli delivered", f"{record.given}", f"at most {limits.max_pulses}" if kept else ""),
        Counted("of them with an unknown outcome", f"{unknown}", ""),
        Counted("shortest time between two stimuli", "not known" if shortest_s is None else f"{shortest_s:.2f} s",
                f"at least {limits.min_iti_s:g} s" if kept else ""),
        Counted("ISIs asked", asked_ms, f"{limits.low_ms:g}–{limits.high_ms:g} ms" if kept else ""),
        Counted("most mistrials in a row", f"{_mistrials_in_a_row(record)}",
                f"a pause after {limits.max_consecutive_mistrials}" if kept else ""),
        Counted("refused before delivery", f"{kinds['refused']}", ""),
        Counted("limits reached", f"{kinds['limit']}", ""),
        Counted("faults", f"{kinds['fault']}", ""),
        Counted("pauses", f"{kinds['pause']}", ""),
    ]  # fmt: skip


def _mistrials_in_a_row(record: SessionRecord) -> int:
    runs = (len(list(run)) for is_lost, run in groupby(t.reason is not None for t in record.table) if is_lost)
    return max(runs, default=0)


def _shortest_s(record: SessionRecord) -> float | None:
    """Between two intents of one run of the session; one that was resumed has another clock."""
    runs: list[list[float]] = [[]]
    for entry in record.history:
        if isinstance(entry, Intent):
            runs[-1].append(entry.t_s)
        elif isinstance(entry, Event) and entry.kind == "refused" and runs[-1]:
            runs[-1].pop()
        elif isinstance(entry, Event) and entry.kind == "resume":
            runs.append([])
    gaps = [after - before for run in runs for before, after in pairwise(run)]
    return min(gaps) if any(gap > 0 for gap in gaps) else None
