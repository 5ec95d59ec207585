"""Going on with a session from its log: the strategy is made again, and the loop continues where it stood."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from isiw.checks import whole
from isiw.devices.clock import Clock
from isiw.devices.limits import Limits
from isiw.devices.protocol import Device, HasMemory
from isiw.errors import (
    ConfigError,
    DamagedLogError,
    DeviceError,
    InvalidValueError,
    OtherVersionsWarning,
    StrategyError,
)
from isiw.log.pulses import pulses_s
from isiw.log.reader import SessionRecord, read_salvaged
from isiw.log.salvage import Salvage, salvage
from isiw.log.schema import MOST_TRIALS, SCHEMA_VERSION, Event, Header, Intent, StrategyRecipe
from isiw.log.writer import LogWriter
from isiw.session.loop import Session, SessionUpdate, learn, versions
from isiw.session.safeguards import Safeguards
from isiw.strategy.catalogue import make_strategy, settings_for
from isiw.strategy.strategy import Strategy
from isiw.texts import plain
from isiw.trials import Stimulus, Trial, TrialTable

__all__ = [
    "Replayed",
    "ages_s",
    "exclude",
    "replay",
    "resume",
    "resumption_text",
    "strategy_of",
    "warn_where_differing",
    "with_lost_pulses",
]

_COMPARED_AT_EACH_END = 50

_RENAMED: Final = {"zero_below_mv": "threshold_mv"}
"""Settings by the names that earlier versions logged them under."""


def resume(  # noqa: PLR0913 - all but three are keyword-only
    path: str | Path,
    device: Device,
    strategy: Strategy | None = None,
    *,
    limits: Limits | None = None,
    clock: Clock | None = None,
    on_trial: Callable[[SessionUpdate], None] | None = None,
    timeout_s: float | None = None,
    ask_deadline_s: float | None = None,
    safeguards: Safeguards | None = None,
    lost_pulses: int | None = None,
    verify: bool = True,
) -> Session:
    """A session that goes on where a log ends. Nothing is delivered or written before its `run`.

    Stimuli whose outcome is not in the log become mistrials "outcome unknown": they count against every limit. What the
    session goes on with is logged as a further header, and holds when it is resumed again.

    Args:
        path: the log, with or without `.part`; finished, torn or damaged.
        device: the device to go on with; one with a memory is brought to where the logged stimuli left it.
        strategy: needed where the session's strategy was built from a user's own objects: the same again.
        limits: other limits than those that were logged last.
        clock: as for `Session`.
        on_trial: as for `Session`.
        timeout_s: another time for one delivery than the logged one [s].
        ask_deadline_s: another time for one ask than the logged one [s].
        safeguards: as for `Session`.
        lost_pulses: needed where the end of a closed log is missing: how many stimuli were given that are not in it any
            more, as the stimulator counted. They become mistrials "outcome unknown".
        verify: whether the strategy must ask again what the log says it asked, at first and at last. With other
            versions than those that were logged a difference is a warning; without verification the logged trials are
            told as they are.

    Raises:
        LogError: no such log, or one of which not even the header can be read.
        DamagedLogError: the log's end is missing, and `lost_pulses` is not given.
        InvalidValueError: `lost_pulses` is no number of stimuli, or the log's end is there.
        StrategyError: the strategy cannot be made again, or asks something else with the same versions.
        DeviceError: a simulated device for a session with a real one, or the other way round.

    Warns:
        OtherVersionsWarning: with other versions than those that were logged the strategy asks something else.
    """
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    header = record.header
    _require_as_real(device, header)
    record = with_lost_pulses(record, lost_pulses)
    replayed = replay(record, strategy.restarted() if strategy else strategy_of(header), verify=verify)
    warn_where_differing(replayed, header)
    if isinstance(device, HasMemory):
        device.resume_after([Stimulus(trial.index, trial.commanded_isi_ms) for trial in replayed.trials])
    session = Session(
        device,
        replayed.strategy,
        log=path,
        limits=limits or header.limits,
        clock=clock,
        on_trial=on_trial,
        subject=header.subject,
        signals=header.signals,
        config=header.config,
        timeout_s=header.timeout_s if timeout_s is None else timeout_s,
        ask_deadline_s=header.ask_deadline_s if ask_deadline_s is None else ask_deadline_s,
        safeguards=safeguards,
    )
    last = len(replayed.trials) - 1 if replayed.trials else None
    event = Event(kind="resume", trial=last, text=resumption_text(record, replayed))

    def open_log(as_resumed: Header) -> LogWriter:
        as_resumed = as_resumed.model_copy(update={"created": header.created, "asks_from": replayed.asks_from})
        return LogWriter.continuing(path, salvaged, header, as_resumed)

    earlier_s = partial(ages_s, salvaged, len(replayed.trials))
    session.continue_from(replayed.trials, open_log, (*replayed.unknown, event), earlier_s)
    return session


def ages_s(salvaged: Salvage, trials: int) -> list[float]:
    """How long ago each stimulus of a log was [s]; 0 for those of which nobody knows when they were.

    Args:
        salvaged: the log.
        trials: how many stimuli there were.
    """
    known_s = pulses_s(salvaged)
    return [*known_s, *[0.0] * (trials - len(known_s))]


@dataclass(frozen=True)
class Replayed:
    """A strategy that has learned a log.

    Args:
        strategy: the strategy.
        trials: all trials, those with unknown outcome included.
        unknown: the trials whose outcome is not in the log.
        differing: trials in which it would have asked something else than was logged with other versions.
        asks_from: the first trial whose ask can be compared with the strategy's from here on; those before were asked
            with other versions, or never compared.
    """

    strategy: Strategy
    trials: TrialTable
    unknown: tuple[Trial, ...]
    differing: tuple[int, ...] = ()
    asks_from: int = 0


def replay(record: SessionRecord, strategy: Strategy, *, verify: bool = True) -> Replayed:
    """Tell a strategy everything that a log holds, in the order in which it was told then.

    A trial that was excluded counts from its exclusion on; asks before it are compared as they were made. Of a long
    session the first and the last asks are compared: the last ones depend on all that was told before.

    Args:
        record: the log.
        strategy: the session's strategy before its first trial.
        verify: whether to compare what the strategy asks with what it asked then.

    Raises:
        StrategyError: it asks something else, although the versions are those that were logged.
    """
    told: list[Trial] = []
    differing: list[int] = []
    first = record.header.asks_from
    by_fallback = {event.trial for event in record.events if event.kind == "fallback"}
    last = max((intent.trial for intent in record.intents), default=0)
    for entry in record.history:
        if isinstance(entry, Intent):
            # Behind a lost trial the strategy knew more than the log does.
            comparable = entry.trial == len(told) and entry.trial >= first and entry.trial not in by_fallback
            near_an_end = min(entry.trial - first, last - entry.trial) < _COMPARED_AT_EACH_END
            if verify and comparable and near_an_end and (asked_ms := strategy.ask()) != entry.isi_ms:
                _require_other_versions(entry, asked_ms, record.header)
                differing.append(entry.trial)
        elif isinstance(entry, Trial):
            learn(strategy, entry)
            told.append(entry)
        elif isinstance(entry, Event) and entry.kind == "exclusion" and entry.trial is not None:
            # In the order of telling, in which a trial that was lost stands behind later ones.
            told = [dataclasses.replace(t, excluded=True) if t.index == entry.trial else t for t in told]
            strategy = strategy.restarted()
            for trial in told:
                learn(strategy, trial)
    unknown = tuple(Trial.unknown(Stimulus(intent.trial, intent.isi_ms)) for intent in record.unknown)
    for trial in unknown:
        learn(strategy, trial)
    table = TrialTable(tuple(sorted((*told, *unknown), key=lambda trial: trial.index)))
    return Replayed(strategy, table, unknown, tuple(differing), len(table) if differing or not verify else first)


def exclude(path: str | Path, trial: int, reason: str) -> None:
    """Exclude a trial afterwards: an event is appended to the log, nothing is erased. Resuming learns without it.

    Args:
        path: the log, with or without `.part`.
        trial: the trial's number.
        reason: why, for whoever reads the log.

    Raises:
        LogError: no such log, or it is still being written.
        DamagedLogError: the log's end is missing; resume the session first.
        InvalidValueError: no such trial, or one that counts for nothing anyway.
    """
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    if trial not in {candidate.index for candidate in record.table.told}:
        raise InvalidValueError(
            "there is no such trial to exclude",
            got=trial,
            expected="the number of an accepted trial that is not excluded yet",
            remedy=f"List them: isiw show {path}",
        )
    _require_end(record)
    with LogWriter.continuing(path, salvaged, record.header) as log:
        log.append(Event(kind="exclusion", trial=trial, text=reason))
        if record.losses:
            log.append(Event(kind="fault", trial=trial, text=" ".join(record.losses)))


def with_lost_pulses(record: SessionRecord, lost_pulses: int | None) -> SessionRecord:
    """A log with the stimuli that its missing end told of.

    Args:
        record: the log.
        lost_pulses: how many stimuli were given that are not in it any more; None where it has its end.

    Raises:
        DamagedLogError: the log's end is missing, and `lost_pulses` is not given.
        InvalidValueError: `lost_pulses` is no number of stimuli, or the log's end is there.
    """
    if lost_pulses is None:
        _require_end(record)
        return record
    lost_pulses = whole("lost_pulses", lost_pulses, least=0, below=MOST_TRIALS)
    if not record.end_lost:
        raise InvalidValueError(
            "lost_pulses is for a log whose end is missing, and this one's is there", got=lost_pulses
        )
    known = len(record.table) + len(record.unknown)
    return dataclasses.replace(record, delivered=known + lost_pulses)


def _require_end(record: SessionRecord) -> None:
    if record.end_lost:
        raise DamagedLogError(
            "the log's end is missing, so nobody knows how many stimuli were given",
            got=str(record.path),
            remedy="Look at the stimulator's counter, and resume with the number of pulses that isiw show does not "
            "list: isiw resume --lost-pulses N, or isiw.resume(..., lost_pulses=N).",
        )


def _require_as_real(device: Device, header: Header) -> None:
    """Raise where the session would go on without waiting or with answers from nobody, or a simulation on a person."""
    info, was = device.describe(), header.device
    if info.simulated and not was.simulated:
        raise DeviceError(
            "the session was run with a real device, and cannot go on with a simulated one",
            got=info.name,
            expected=f"a real one, as {was.name} was",
            remedy="Describe the device with DeviceInfo(..., simulated=False), which makes the session wait between "
            "trials in real time.",
        )
    if was.simulated and not info.simulated:
        raise DeviceError(
            "the session was run with a simulated device, and its limits and trials are no person's",
            got=info.name,
            expected=f"a simulated one, as {was.name} was",
            remedy="Start a session of its own with the real device: isiw.Session(device, strategy, log=NEW_PATH).",
        )


def strategy_of(header: Header) -> Strategy:
    """The strategy of a logged session, before its first trial.

    Args:
        header: of the log.

    Raises:
        StrategyError: it was built from a user's own objects.

    Warns:
        OtherVersionsWarning: it has settings of an earlier version that this one does not know.
    """
    recipe = header.strategy
    if not recipe.name:
        raise StrategyError(
            "the session's strategy was built from a user's own objects, which no log can hold",
            remedy="Build the same strategy again and hand it over: isiw.resume(path, device, strategy).",
        )
    settings = recipe.settings
    if header.schema_version < SCHEMA_VERSION:
        settings = _known_settings(recipe)
    return make_strategy(recipe.name, space=header.space, seed=recipe.seed, **settings)


def _known_settings(recipe: StrategyRecipe) -> dict[str, Any]:
    """The settings of an earlier version that this one knows; a warning names the others."""
    known = {}
    for key, value in recipe.settings.items():
        try:
            settings_for(recipe.name, **{_RENAMED.get(key, key): value})
        except (ConfigError, StrategyError, InvalidValueError):
            continue
        known[_RENAMED.get(key, key)] = value
    if unknown := sorted(key for key in recipe.settings if _RENAMED.get(key, key) not in known):
        text = f"Settings of an earlier version are not known any more, and are as by default: {', '.join(unknown)}."
        warnings.warn(text, OtherVersionsWarning, stacklevel=3)
    return known


def _require_other_versions(intent: Intent, asked_ms: float, header: Header) -> None:
    """Raise where the strategy has no reason to ask something else than it did."""
    if header.schema_version == SCHEMA_VERSION and versions() == {**header.versions, "isiw": header.isiw_version}:
        raise StrategyError(
            f"the strategy does not ask again what was asked in trial {intent.trial}",
            got=f"{asked_ms:g} ms",
            expected=f"{intent.isi_ms} ms, as logged with {_versions_text(header)}",
            remedy="Resume with the same strategy and on the same machine, or without verification: the logged trials "
            "are then told as they are.",
        )


def _versions_text(header: Header) -> str:
    logged = {"isiw": header.isiw_version, **header.versions}
    return plain(", ".join(f"{name} {version}" for name, version in logged.items()))


def warn_where_differing(replayed: Replayed, header: Header) -> None:
    """Warn whoever resumes a session that other versions would have asked something else.

    Args:
        replayed: the strategy that has learned the log.
        header: the log's.
    """
    if replayed.differing:
        warnings.warn(_differing_text(replayed, header), OtherVersionsWarning, stacklevel=3)


def _differing_text(replayed: Replayed, header: Header) -> str:
    return (
        f"The session was logged with {_versions_text(header)}, log schema {header.schema_version}. With the versions "
        f"installed here the strategy would have asked something else in {len(replayed.differing)} of "
        f"{len(replayed.trials)} trials. The logged trials count as they were; asks from here on may differ from those "
        "of an uninterrupted session."
    )


def resumption_text(record: SessionRecord, replayed: Replayed) -> str:
    """What the log says about a resumption.

    Args:
        record: the log.
        replayed: the strategy that has learned it.
    """
    sentences = [f"Resumed after {len(replayed.trials)} trials."]
    if replayed.differing:
        sentences.append(_differing_text(replayed, record.header))
    if replayed.unknown:
        numbers = ", ".join(str(trial.index) for trial in replayed.unknown)
        sentences.append(f"Outcome unknown: {numbers}.")
    return " ".join((*sentences, *record.losses))
