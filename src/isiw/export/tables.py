"""Three tables of some sessions: what each session is and found, its trials, and what happened to it."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from isiw.dissertation.response_counts import by_isi, count_trials
from isiw.errors import InvalidValueError
from isiw.export.collection import Part, log_losses, stimulus_of
from isiw.figures import Estimate
from isiw.files import write_output
from isiw.lazy import pd
from isiw.log.frames import meanings, trial_columns, trial_frame
from isiw.log.record import SessionRecord
from isiw.text.sanitize import one_line
from isiw.text.stimuli import STIMULI, TAP, StimulusWords

Columns = Mapping[str, tuple[str, str]]

_WHOSE: Final[Columns] = {
    "subject": ("", "the person's code"),
    "session": ("", "the number of the person's session, in the order in which they were begun"),
}

_SESSION_COLUMNS: Final[Columns] = {
    "log": ("", "the name of the log"),
    "created": ("", "when it was begun, UTC"),
    "simulated": ("", "whether nobody was stimulated"),
    "device": ("", "what the device calls itself"),
    "conditioning": ("", "what comes first: {0.given}"),
    "reference": ("", "the event that ISIs count from: the {0.moment}, or the command that opens the valve"),
    "low_ms": ("ms", "the first ISI that could be delivered"),
    "high_ms": ("ms", "the last ISI that could be delivered"),
    "strategy": ("", "the strategy's name; none for one of a user's own objects"),
    "seed": ("", "the seed of the session"),
    "isiw_version": ("", "the version of isiw that wrote the log"),
    "day": ("", "the number of the person's visit, if noted"),
    "operator": ("", "who ran the session, if noted"),
    "muscle": ("", "whose EMG was recorded, if noted"),
    "electrodes": ("", "which, and where they were, if noted"),
    "intensity_pct_rmt": ("%", "intensity of the pulse, of the resting motor threshold"),
    "intensity_pct_mso": ("%", "intensity of the pulse, of the maximum stimulator output"),
    "age_years": ("year", "the person's age, if noted"),
    "height_cm": ("cm", "the person's height, if noted"),
    "tap_n": ("N", "peak force of the tap, if noted"),
    "given_before": ("", "stimuli before them that count for the limits, such as pulses over the recruitment curve"),
    "delivered": ("", "stimuli that were given in the session, or may have been"),
    "told": ("", "trials that the strategy learnt from"),
    "mistrials": ("", "trials that were judged to be mistrials"),
    "p_window": ("", "probability that there is a window, at the end; empty, as the result, after too few trials"),
    "window": ("", "the window that was reported, its segments; empty if none was"),
    "start_ms": ("ms", "where the reported window starts; empty if none was reported"),
    "end_ms": ("ms", "where it ends"),
    "start_low_ms": ("ms", "lower end of the 90 % interval of its start; infinite beyond the range"),
    "start_high_ms": ("ms", "upper end of the 90 % interval of its start"),
    "end_low_ms": ("ms", "lower end of the 90 % interval of its end"),
    "end_high_ms": ("ms", "upper end of the 90 % interval of its end"),
    "best_isi_ms": ("ms", "the ISI of the largest expected MEP, given a window: posterior median"),
    "enhancement_mv": ("mV", "by how much the expected MEP there is larger than of TMS alone: posterior median"),
    "enhancement_low_mv": ("mV", "lower end of its 90 % interval"),
    "enhancement_high_mv": ("mV", "upper end of its 90 % interval"),
    "enhancement_ratio": ("", "how many times as large as of TMS alone it is: posterior median"),
    "enhancement_ratio_low": ("", "lower end of its 90 % interval"),
    "enhancement_ratio_high": ("", "upper end of its 90 % interval"),
    "counts_threshold_mv": ("mV", "what an MEP has to exceed to be a response, for the response counts"),
    "counts_window": ("", "the window by response counts [Kim2020, 3.3.4]; empty if no ISI is effective"),
    "stopped": ("", "whether the strategy had stopped"),
    "why": ("", "why it stopped, or continued"),
    "judged_since": ("", "whether trials were excluded, included or judged after this result, which is then outdated"),
    "lacks": ("", "what the log lacks; empty if it is whole"),
}

EVENT_COLUMNS: Final[Columns] = {
    "kind": ("", "what kind of thing happened"),
    "trial": ("", "the trial that was judged, refused or answered late; else the last one before the event"),
    "text": ("", "what happened, in words"),
}
"""Unit and meaning of what is said about an event."""

_ENCODERS: Final[Mapping[str, Callable[[pd.DataFrame, io.BytesIO], None]]] = {
    "csv": lambda frame, file: _spelt(frame).to_csv(file, index=False, na_rep=""),
    "parquet": lambda frame, file: frame.to_parquet(file, index=False),
}


def write_tables(parts: Sequence[Part], folder: Path, suffix: str) -> None:
    """Write the tables `sessions`, `trials` and `events`, and `columns`, which says what is in them."""
    first = stimulus_of(parts)
    contents = {"sessions": session_columns(first), "trials": {"trial": ("", "its number"), **trial_columns(first)},
                "events": EVENT_COLUMNS}  # fmt: skip
    facts = [part.whose | session_facts(part.record) for part in parts]
    sessions = pd.DataFrame(facts, columns=[*_WHOSE, *contents["sessions"]]).astype({"day": "Int64"})
    tables = {"sessions": sessions, "trials": all_trials(parts), "events": _events(parts)}
    meanings = [
        (table, name, unit, meaning)
        for table, columns in contents.items()
        for name, (unit, meaning) in {**_WHOSE, **columns}.items()
    ]
    tables["columns"] = pd.DataFrame(meanings, columns=["table", "column", "unit", "meaning"])
    for name, frame in tables.items():
        content = io.BytesIO()
        _ENCODERS[suffix](tidy(frame), content)
        write_output(folder / f"{name}.{suffix}", content.getvalue())


def session_columns(first: StimulusWords) -> dict[str, tuple[str, str]]:
    """Unit and meaning of the columns of sessions; the conditioning stimulus is one if it is not always a tap."""
    columns = meanings(_SESSION_COLUMNS, first)
    left_out = "conditioning" if first == TAP else "tap_n" if first == STIMULI["electrical"] else ""
    return {name: said for name, said in columns.items() if name != left_out}


def tidy(frame: pd.DataFrame) -> pd.DataFrame:
    """A table whose texts are on one line each, without what a terminal would obey."""
    is_object, is_string = pd.api.types.is_object_dtype, pd.api.types.is_string_dtype
    texts = [name for name in frame.columns if is_object(frame[name]) or is_string(frame[name])]
    return frame.assign(**{name: frame[name].map(lambda x: one_line(x) if isinstance(x, str) else x) for name in texts})


def _spelt(frame: pd.DataFrame) -> pd.DataFrame:
    """The same with TRUE and FALSE for booleans, since R reads the True and False of Python as texts."""
    flags = frame.loc[:, [kind.kind in "bO" for kind in frame.dtypes]]
    return frame.assign(**flags.map(lambda said: str(said).upper() if isinstance(said, bool) else said))


def all_trials(parts: Sequence[Part]) -> pd.DataFrame:
    """The trials of all sessions, a row a trial, each with its person, session and number."""
    frames = [trial_frame(part.record).rename_axis("trial").reset_index().assign(**part.whose) for part in parts]
    table = pd.concat(frames, ignore_index=True).astype(dict.fromkeys(_WHOSE, object))
    return table[[*_WHOSE, *(name for name in table.columns if name not in _WHOSE)]]


def _events(parts: Iterable[Part]) -> pd.DataFrame:
    rows: list[dict[str, Any]] = [
        {**part.whose, "kind": event.kind, "trial": event.trial, "text": event.text}
        for part in parts
        for event in part.record.events
    ]
    return pd.DataFrame(rows, columns=[*_WHOSE, *EVENT_COLUMNS]).astype({"trial": "Int64"})


def session_facts(record: SessionRecord) -> dict[str, Any]:
    """The facts and the result of a session, as in `session_columns`."""
    return _what_it_is(record) | _what_came_of_it(record) | {"lacks": " ".join(log_losses(record))}


def _what_it_is(record: SessionRecord) -> dict[str, Any]:
    header = record.header
    return {
        "log": record.path.name,
        "created": header.created,
        "simulated": header.device.simulated,
        "device": header.device.name,
        "conditioning": header.conditioning,
        "reference": header.space.reference,
        "low_ms": header.space.low_ms,
        "high_ms": header.space.high_ms,
        "strategy": header.strategy.name,
        "seed": header.seed,
        "isiw_version": header.isiw_version,
        **{name: getattr(header.visit, name) for name in header.visit.__dataclass_fields__},
    }


def _what_came_of_it(record: SessionRecord) -> dict[str, Any]:
    counts = {
        "given_before": record.header.given_before,
        "delivered": record.given,
        "told": len(record.table.told),
        "mistrials": sum(trial.reason is not None for trial in record.table),
    }
    if not record.estimates:
        return counts
    last = record.estimates[-1]
    ended = {"stopped": last.stop, "why": last.reason, "judged_since": record.is_judged_since}
    if not record.rests_on_data:
        return counts | ended
    edges = ("start_low_ms", "start_high_ms", "end_low_ms", "end_high_ms")
    found = {"p_window": last.probability, "window": ""}
    if (window := last.window) is not None:
        found |= {"window": str(window), "start_ms": window.start_ms, "end_ms": window.end_ms}
    edges_ms = {name: getattr(last, name) for name in edges}
    return counts | found | edges_ms | _magnitude(last) | _by_counts(record) | ended


def _magnitude(last: Estimate) -> dict[str, float]:
    """The best ISI and the size of the enhancement there, if a window was reported and its model says so."""
    if last.window is None or not (last.best_isi_ms and last.enhancement_mv):
        return {}
    sizes = ("enhancement_mv", "enhancement_low_mv", "enhancement_high_mv")
    ratios = ("enhancement_ratio", "enhancement_ratio_low", "enhancement_ratio_high")
    named = zip((*sizes, *ratios), (*last.enhancement_mv, *last.enhancement_ratio), strict=True)
    return {"best_isi_ms": last.best_isi_ms[0], **dict(named)}


def _by_counts(record: SessionRecord) -> dict[str, Any]:
    """The result of response counts; nothing of values that are no MEPs."""
    try:
        study = count_trials(by_isi(record.table))
    except InvalidValueError:
        return {}
    return {"counts_threshold_mv": study.threshold_mv, "counts_window": str(study.window or "")}
