"""The tables of a report: trials, what was lost, events, what was counted for safety, and what the session is."""

from __future__ import annotations

import dataclasses
import json
import math
from collections import Counter
from collections.abc import Mapping
from itertools import groupby, pairwise
from typing import Any, NamedTuple

from isiw.devices.limits import Limits
from isiw.devices.protocol import NOT_PROTECTED, unprotected
from isiw.findings import Kind
from isiw.log.record import SessionRecord
from isiw.log.schema import Event, Intent
from isiw.sentences import asked, outcome
from isiw.signals.measures import Measures
from isiw.text.sanitize import counted
from isiw.text.stimuli import TAP, StimulusWords
from isiw.trials import Trial


class Fact(NamedTuple):
    """One thing that is known of a session."""

    name: str
    value: str


def first_facts(record: SessionRecord) -> list[Fact]:
    """Subject, date, device, limits, strategy with its seed, and version, a line each whatever is in them."""
    header = record.header
    versions = ", ".join(f"{package} {version}" for package, version in header.versions.items())
    own = {"trials": f"imported from {header.source}; {_whose(header.device.simulated)}"}
    session = {"device": _device(record), "limits": _limits(header.limits)}
    groups = {
        "subject": _subject(record),
        "date": ("" if record.begun else "not known; imported ")
        + header.created.replace("T", " ").replace("+00:00", " UTC"),
        **(own if header.imported else session),
        **({"earlier": f"{counted(len(header.earlier), 'trial')}, learnt before the first"} if header.earlier else {}),
        "strategy": f"{header.strategy.name or 'of own objects'}, seed {header.strategy.seed}",
        "version": f"isiw {header.isiw_version}" + (f" ({versions})" if versions else ""),
    }
    parts = {"date": "created", "version": "isiw_version"}
    return [Fact(name, " ".join(_read(record, parts.get(name, name), value).split())) for name, value in groups.items()]


def further_facts(record: SessionRecord) -> list[Fact]:
    """The rest of what the log's header says: visit, ISIs, judgement, protocol."""
    header = record.header
    deadline_s = header.ask_deadline_s
    loop = {
        "protocol": header.protocol,
        "deadline of a delivery": f"{header.timeout_s:g} s",
        "deadline of a choice": "none" if deadline_s is None else f"{deadline_s:g} s",
    }
    groups: dict[str, Any] = {
        "visit": header.visit,
        "ISIs": header.space.in_words(header.stimulus),
        "tolerance": f"{header.space.tolerance_ms:g} ms",
        "judgement of a sweep": header.signals,
        **({} if header.imported else loop),
        "log": f"{record.path.name}, schema {header.schema_version}",
    }
    shown = {name: value if isinstance(value, str) else _fields(value) for name, value in groups.items()}
    parts = {
        "judgement of a sweep": "signals",
        "deadline of a delivery": "timeout_s",
        "deadline of a choice": "ask_deadline_s",
    }
    return [Fact(name, _read(record, parts.get(name, name), value)) for name, value in shown.items() if value]


def settings_facts(record: SessionRecord) -> list[Fact]:
    """The strategy's settings, those of a group with dots, as a configuration can have them."""
    return [
        Fact(key, json.dumps(value, ensure_ascii=False))
        for key, value in _flat(record.header.strategy.settings).items()
    ]


def _read(record: SessionRecord, part: str, value: str) -> str:
    """The text of a part of the header, unless it cannot be read: then what it is by default says nothing."""
    return "cannot be read by this version of isiw" if part in record.unread else value


def _subject(record: SessionRecord) -> str:
    visit = record.header.visit
    parts = [record.header.subject or "not named"]
    parts += [f"day {visit.day}"] if visit.day is not None else []
    parts += [f"operator {visit.operator}"] if visit.operator else []
    return ", ".join(parts)


def _device(record: SessionRecord) -> str:
    info = record.header.device
    parts = [info.name, *([f"version {info.version}"] if info.version else [])]
    parts += [f"at {info.address}"] if info.address else []
    return ", ".join([*parts, _whose(info.simulated), *([NOT_PROTECTED] if unprotected(info) else [])])


def _whose(simulated: bool) -> str:  # noqa: FBT001 - it is all that is said
    return "simulated: nobody was stimulated" if simulated else "real"


def _limits(limits: Limits) -> str:
    said = [
        f"ISIs of {limits.low_ms:g}–{limits.high_ms:g} ms",
        f"at most {limits.max_pulses} stimuli",
        f"at least {limits.iti_s:g} s apart",
        f"a pause after {limits.max_consecutive_mistrials} mistrials in a row",
    ]
    if limits.max_block_pulses is not None:
        said.append(f"a rest of {limits.rest_s:g} s after {limits.max_block_pulses} stimuli")
    if limits.max_period_pulses is not None:
        said.append(f"at most {limits.max_period_pulses} in {limits.period_s:g} s")
    if limits.max_coil_c is not None:
        said.append(f"a coil of at most {limits.max_coil_c:g} °C")
    if limits.intensity_pct_mso is not None:
        said.append(f"only at {limits.intensity_pct_mso:g} % MSO")
    if limits.max_intensity_pct_rmt is not None:
        said.append(f"no intensity above {limits.max_intensity_pct_rmt:g} % RMT")
    return ", ".join(said)


def _fields(settings: Any) -> str:
    """The fields of a dataclass that are set, in words."""
    values = dataclasses.asdict(settings)
    said = {name: value for name, value in values.items() if value not in (None, "") and value is not False}
    return ", ".join(f"{name} {_value(value)}" for name, value in said.items())


def _value(value: Any) -> str:
    if isinstance(value, tuple | list):
        return "–".join(map(_value, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _flat(settings: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in settings.items():
        name = f"{before}{key}"
        flat |= _flat(value, f"{name}.") if isinstance(value, Mapping) else {name: value}
    return flat


class TrialRow(NamedTuple):
    """A trial in words."""

    trial: int
    asked: str
    realised: str
    outcome: str
    shape: str
    background: str
    remark: str


class Counted(NamedTuple):
    """Something that was counted, and what it may be at most or at least."""

    what: str
    found: str
    limit: str


def trial_row(trial: Trial, first: StimulusWords = TAP, measured: Measures | None = None) -> TrialRow:
    """One trial of the table of all trials."""
    return TrialRow(
        trial.index,
        asked(trial, first),
        "–" if trial.isi_ms is None else f"{trial.isi_ms:.1f} ms",
        outcome(trial),
        _shape(measured),
        "–" if trial.background_rms_uv is None else f"{trial.background_rms_uv:.2g} µV",
        _remark(trial, first),
    )


def _shape(measured: Measures | None) -> str:
    if measured is None or math.isnan(measured.mep_onset_ms):
        return "–"
    silent_ms = measured.silent_period_ms
    return f"{measured.mep_onset_ms:.1f} ms, {measured.mep_duration_ms:.1f} ms, {measured.mep_area_mv_ms:.3g} mV·ms" + (
        "" if math.isnan(silent_ms) else f", silent until {silent_ms:.0f} ms"
    )


def _remark(trial: Trial, first: StimulusWords) -> str:
    if trial.overruled is not None:
        return f"accepted by the operator; had been: {trial.overruled}"
    if trial.reason is not None and trial.mep_mv is not None:
        return f"{1e3 * trial.mep_mv:.0f} µV were measured"
    if trial.tap_alone and trial.counts:
        return f"shows the {first.name}'s own response; does not count as a pair"
    return ""


def lost_rows(record: SessionRecord) -> list[tuple[int, str, str]]:
    """Trials that do not count: number, what was asked, and why; those of unknown outcome too."""
    excluded = {event.trial: event for event in record.events if event.kind == "exclusion"}
    said = {number: f"excluded by {_judge(event)}: {event.text}".rstrip(": ") for number, event in excluded.items()}
    lost = [trial for trial in (*record.table, *record.unknown_trials) if not trial.counts]
    why = {t.index: str(t.reason or said.get(t.index, "excluded by the operator")) for t in lost}
    return sorted((t.index, asked(t, record.header.stimulus), why[t.index]) for t in lost)


def _judge(exclusion: Event) -> str:
    return "the operator" if exclusion.finding is None else "isiw"


def event_rows(record: SessionRecord) -> list[tuple[str, str, str]]:
    """Events in the order in which they were logged: the trial before or about which, the kind, and the text."""
    return [("–" if event.trial is None else str(event.trial), event.kind, event.text) for event in record.events]


def counted_rows(record: SessionRecord) -> list[Counted]:
    """The numbers of what was delivered, against what the limits allow."""
    limits, kinds = record.header.limits, Counter(event.kind for event in record.events)
    wanted_ms = [trial.commanded_isi_ms for trial in record.table] + [intent.isi_ms for intent in record.unknown]
    isis_ms = [isi_ms for isi_ms in wanted_ms if isi_ms is not None]
    asked_ms = f"{min(isis_ms):g}–{max(isis_ms):g} ms" if isis_ms else "–"
    kept = "limits" not in record.unread
    before = record.header.given_before
    most = f"{limits.max_pulses}" + (f", with {before} before the session" if before else "")
    unknown = sum(trial.reason is Kind.OUTCOME_UNKNOWN for trial in record.table) + len(record.unknown)
    shortest = _shortest(record)
    runs = (len(list(run)) for is_lost, run in groupby(t.reason is not None for t in record.table) if is_lost)
    return [
        Counted("stimuli delivered", f"{record.given}", f"at most {most}" if kept else ""),
        Counted("of them with an unknown outcome", f"{unknown}", ""),
        Counted("shortest time between two stimuli", shortest,
                f"at least {limits.iti_s:g} s" if kept else ""),
        Counted("ISIs commanded", asked_ms, f"{limits.low_ms:g}–{limits.high_ms:g} ms" if kept else ""),
        Counted("most mistrials in a row", f"{max(runs, default=0)}",
                f"a pause after {limits.max_consecutive_mistrials}" if kept else ""),
        Counted("refused before delivery", f"{kinds['refused']}", ""),
        Counted("limits reached", f"{kinds['limit']}", ""),
        Counted("faults", f"{kinds['fault']}", ""),
        Counted("pauses", f"{kinds['pause']}", ""),
    ]  # fmt: skip


def _shortest(record: SessionRecord) -> str:
    """Within a run of the session by its clock; over a resumption, which has another one, by the computer's."""
    runs: list[list[Intent]] = [[]]
    for entry in record.history:
        if isinstance(entry, Intent):
            runs[-1].append(entry)
        elif isinstance(entry, Event) and entry.kind == "refused" and runs[-1]:
            runs[-1].pop()
        elif isinstance(entry, Event) and entry.kind == "resume":
            runs.append([])
    runs = [run for run in runs if run]
    gaps_s = [after.t_s - before.t_s for run in runs for before, after in pairwise(run)]
    over_s = [_onset_s(record, after[0]) - _onset_s(record, before[-1]) for before, after in pairwise(runs)]
    known_s = [] if record.header.device.simulated else [gap_s for gap_s in over_s if gap_s > 0]
    if not any(gap_s > 0 for gap_s in gaps_s):
        gaps_s = []
    left_out = "" if len(known_s) == len(over_s) else "; across a resumption not known"
    return f"{min(*gaps_s, *known_s, math.inf):.2f} s{left_out}" if gaps_s or known_s else "not known"


def _onset_s(record: SessionRecord, intent: Intent) -> float:
    """When a stimulus was about to be delivered, since the first one [s]; a clock that was set back tells nothing."""
    onset = record.onsets.get(intent.trial)
    return math.nan if onset is None else onset.onset_s
