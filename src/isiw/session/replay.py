"""Replaying a log: its strategy is made again, and learns everything that the log holds."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Final, NamedTuple

from isiw.change import MOST_NOTED
from isiw.checks import MOST_TRIALS, whole
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.errors import (
    ConfigError,
    DamagedLogError,
    DeviceError,
    InvalidValueError,
    OtherVersionsWarning,
    StrategyError,
    warn,
)
from isiw.log.continuing import OWN_LOOP, continued_by
from isiw.log.headers import SCHEMA_VERSION, Header, StrategyRecipe
from isiw.log.moments import Ages, Moment
from isiw.log.new_verdicts import MANY_CHANGES
from isiw.log.pulses import pulse_ages
from isiw.log.record import SessionRecord
from isiw.log.salvage import Salvage
from isiw.log.schema import Event, Intent
from isiw.log.verdicts import VERDICTS, changed_after, under
from isiw.log.writer import LogWriter
from isiw.pairing.agenda import Agenda
from isiw.session.assembly import ENGINE_VERSION, ESTIMATE_VERSION, versions
from isiw.session.earlier import Earlier
from isiw.session.examination import relearned
from isiw.signals.limits import SignalLimits
from isiw.signals.tap import TapResponses
from isiw.strategy.catalogue import remade_strategy, settings_for
from isiw.strategy.strategy import Strategy
from isiw.sweeps import Sweep
from isiw.text.sanitize import plain
from isiw.trials import Trial, TrialTable

_COMPARED_AT_EACH_END = 50

_RENAMED: Final = {"zero_below_mv": "threshold_mv"}
"""Settings by the names that earlier versions logged them under."""


class Replayed(NamedTuple):
    """A strategy that has learned a log; asks in `differing` trials, and before `asks_from`, are other versions'."""

    strategy: Strategy
    trials: TrialTable
    unknown: tuple[Trial, ...]
    differing: tuple[int, ...]
    asks_from: int


def replay(
    record: SessionRecord, strategy: Strategy, *, verify: bool = True, replayed: Callable[[int], None] = lambda _: None
) -> Replayed:
    """Let a strategy learn everything that a log holds, in the order in which it was learnt then.

    What an operator said about a trial holds from then on; asks before it are compared as they were made. Of a long
    session the first and the last asks are compared: the last ones depend on all that was learnt before.
    """
    if strategy.space != record.header.space:
        raise StrategyError(
            "the strategy has another design space than the session",
            got=str(strategy.space),
            expected=str(record.header.space),
            remedy="Make it with space=isiw.read_session(LOG).header.space.",
        )
    seed = record.header.strategy.seed
    if verify and strategy.seed != seed:  # by chance it may have asked the same so far
        raise StrategyError(
            "the strategy has another seed than the session",
            got=strategy.seed,
            expected=str(seed),
            remedy=f"Make it with seed={seed}.",
        )
    learned: list[Trial] = []
    changes: list[int] = []
    differing: list[int] = []
    ask = _asking(record.header, strategy)
    first, compared, judged = record.header.asks_from, _compared(record) if verify else frozenset(), False
    for entry in record.history:
        if judged and isinstance(entry, Intent | Trial):
            strategy, judged = relearned(strategy, learned, changes), False
        if isinstance(entry, Intent):
            # Behind a lost trial the strategy knew more than the log does.
            comparable = entry.isi_ms is not None and entry.trial == len(learned) and entry.trial in compared
            if comparable and not is_asked_again(asked_ms := ask(strategy, learned), strategy, entry):
                _require_other_versions(entry, asked_ms, record.header)
                differing.append(entry.trial)
        elif isinstance(entry, Trial):
            strategy.learn(entry)
            learned.append(entry)
            replayed(len(learned))
        elif isinstance(entry, Event) and entry.kind in {*VERDICTS, "change"}:
            # In the order of learning, in which a trial that was lost stands behind later ones.
            learned, changes = [under(trial, entry) for trial in learned], [*changes, *changed_after([entry])]
            judged = True
    strategy = relearned(strategy, learned, changes) if judged else strategy
    unknown = record.unknown_trials
    for trial in unknown:
        strategy.learn(trial)
    strategy.in_doubt = record.in_doubt
    table = TrialTable(tuple(sorted((*learned, *unknown), key=lambda trial: trial.index)))
    return Replayed(strategy, table, unknown, tuple(differing), len(table) if differing or not verify else first)


def _asking(header: Header, strategy: Strategy) -> Callable[[Strategy, Sequence[Trial]], float]:
    """What asks for an ISI after some trials: the strategy, or the agenda of an intervention."""
    if header.intervention is None:
        return lambda strategy, _: strategy.ask()
    agenda = Agenda(header.intervention, strategy, header.seed)
    return lambda _, trials: agenda.isi_ms(trials)


def is_asked_again(asked_ms: float, strategy: Strategy, intent: Intent) -> bool:
    """Whether what is asked is what was asked, at the intensity that was asked for, if there are several."""
    same_pct_rmt = not strategy.intensities or strategy.intensity_pct_rmt == intent.intensity_pct_rmt
    return asked_ms == intent.isi_ms and same_pct_rmt


def _compared(record: SessionRecord) -> frozenset[int]:
    """The first and the last trials whose asks are compared; a fallback was no ask of the strategy."""
    first = record.header.asks_from
    last = max((intent.trial for intent in record.intents), default=0)
    of_each_end = range(first, first + _COMPARED_AT_EACH_END), range(last - _COMPARED_AT_EACH_END + 1, last + 1)
    near_an_end = {number for numbers in of_each_end for number in numbers if number >= first}
    return frozenset(near_an_end) - {event.trial for event in record.events if event.kind == "fallback"}


_GONE: Final = frozenset({"engine", "device"})
"""Settings that said who computes, in torch or compiled: there is one engine now, which the log's versions state."""


def strategy_of(header: Header) -> Strategy:
    """The strategy of a logged session, before its first trial; it warns of settings that are not known any more."""
    recipe = header.strategy
    if not recipe.name:
        raise StrategyError(
            "the session's strategy was built from a user's own objects, which no log can hold",
            remedy="Build the same strategy again and hand it over: isiw.resume(path, device, strategy).",
        )
    settings = {key: value for key, value in recipe.settings.items() if key not in _GONE}
    if header.schema_version < SCHEMA_VERSION:
        settings = _known_settings(recipe.model_copy(update={"settings": settings}))
    return knowing_earlier(remade_strategy(recipe.name, header.space, recipe.seed, **settings), header)


def knowing_earlier(strategy: Strategy, header: Header) -> Strategy:
    """A strategy that has learnt what a session's had before its first ask; the same if it has already."""
    if header.earlier and not strategy.earlier:
        same, changed = header.earlier_same_level, header.earlier_changed
        strategy.learn_all(header.earlier, same_level=same, changed_after=changed)
    strategy.only_counts = header.intervention is not None
    return strategy


def _known_settings(recipe: StrategyRecipe) -> dict[str, Any]:
    """The settings of an earlier version that this one knows; a warning names the others."""
    known = {}
    settings = {_RENAMED.get(key, key): value for key, value in recipe.settings.items()}
    if "max_iterations" in settings:  # which left the initial trials out
        settings["max_trials"] = settings["initial"] + settings.pop("max_iterations")
    for key, value in settings.items():
        try:
            settings_for(recipe.name, **{key: value})
        except (ConfigError, StrategyError, InvalidValueError):
            continue
        known[key] = value
    if unknown := sorted(settings.keys() - known.keys()):
        text = f"Settings of an earlier version are not known any more, and are as by default: {', '.join(unknown)}."
        warn(text, OtherVersionsWarning)
    return known


def _require_other_versions(intent: Intent, asked_ms: float, header: Header) -> None:
    """Raise if the strategy has no reason to ask something else than it did."""
    now = SCHEMA_VERSION, ESTIMATE_VERSION, ENGINE_VERSION
    same = (header.schema_version, header.belief_version, header.engine_version) == now
    if same and versions() == {**header.versions, "isiw": header.isiw_version}:
        raise StrategyError(
            f"the strategy does not ask again what was asked in trial {intent.trial}",
            got=f"{asked_ms:g} ms",
            expected=f"{intent.isi_ms} ms, as logged with {versions_text(header)}",
            remedy="Resume with the same strategy and on the same machine, or without verification: the logged trials "
            "are then told as they are.",
        )


def versions_text(header: Header) -> str:
    """The versions that a session was logged with."""
    logged = {"isiw": header.isiw_version, "belief": header.belief_version, **header.versions}
    return plain(", ".join(f"{name} {version}" for name, version in logged.items()))


def taken_up(
    salvaged: Salvage, record: SessionRecord, strategy: Strategy | None, limits: Limits, options: Mapping[str, Any]
) -> tuple[Strategy, Earlier]:
    """The strategy that has learnt a log, and where the log ends; it warns if other versions ask something else.

    Of the options of `isiw.resume` it knows `lost_pulses`, `verify` and `replayed`.
    """
    record = _with_lost_pulses(record, options.get("lost_pulses"))
    header = record.header
    strategy = knowing_earlier(strategy, header) if strategy else strategy_of(header)
    how = {name: options[name] for name in ("verify", "replayed") if name in options}
    found = replay(record, strategy, **how)
    if found.differing:
        warn(_differing_text(found, header), OtherVersionsWarning)
    return found.strategy, Earlier(
        partial(LogWriter.continuing, salvaged.path, salvaged, header),
        found.trials,
        record.events,
        {"created": header.created, "asks_from": found.asks_from, "earlier_given": header.given_before},
        (*found.unknown, _resumption(record, found, limits)),
        partial(_ages, salvaged, found.trials),
        partial(_taps, record),
        partial(_ago_s, record),
    )


def _ages(salvaged: Salvage, trials: TrialTable) -> Ages:
    """How long ago the stimuli of a log were given; those of which it does not say when, just now."""
    known = pulse_ages(salvaged)
    return Ages((*known.ages_s, *[0.0] * (len(trials) - len(known.ages_s))), known.doubts)


def _ago_s(record: SessionRecord, trial: int) -> float | None:
    """How long ago a trial was about to be delivered [s]; None where the log does not say when."""
    onset, intents = record.onsets.get(trial), record.intents
    if onset is None:
        return None
    last = intents[-1]
    at = record.onsets[last.trial]
    now, moment = Moment.now(), Moment(at.at_ns, last.boot_id, last.boot_s)
    since_s = now.since_s(moment)
    since_s = max(0.0, (now.wall_ns - at.at_ns) / 1e9) if since_s is None else since_s
    return at.onset_s - onset.onset_s + since_s


def _taps(record: SessionRecord, signals: SignalLimits) -> TapResponses:
    """The first stimulus's own response, as the sweeps of a log show it."""
    taps = TapResponses(signals.mep_window_ms)
    for trial in (entry for entry in record.history if isinstance(entry, Trial)):
        taps, _ = taps.corrected(record.table)  # after the last trial the session itself does, if it ended before that
        if channels := record.sweep(trial.index):
            taps = taps.after(trial, Sweep(channels, trial.t_valve_ms, trial.t_tms_ms, trial.t_hit_ms))
    return taps


def _with_lost_pulses(record: SessionRecord, lost_pulses: int | None) -> SessionRecord:
    """A log with the stimuli that its missing end told of."""
    if lost_pulses is None:
        require_end(record)
        return record
    lost_pulses = whole("lost_pulses", lost_pulses, least=0, below=MOST_TRIALS)
    if not record.end_lost:
        raise InvalidValueError(
            "lost_pulses is for a log whose end is missing, and this one's is there", got=lost_pulses
        )
    return dataclasses.replace(record, delivered=record.given + lost_pulses)


def require_end(record: SessionRecord) -> None:
    """Raise if nobody knows how many stimuli were given."""
    if record.end_lost:
        raise DamagedLogError(
            "the log's end is missing, so the number of stimuli given is unknown",
            got=str(record.path),
            remedy="Look at the stimulator's counter, and resume with the number N of pulses that isiw show does not "
            f"list: {continued_by(record.path, record.header, end_lost=True)}",
        )


def require_as_real(info: DeviceInfo, was: DeviceInfo) -> None:
    """Raise if the session would go on without waiting or with answers from nobody, or a simulation on a person."""
    if info.simulated and not was.simulated:
        raise DeviceError(
            "the session was run with a real device, and cannot be continued with a simulated one",
            got=info.name,
            expected=f"a real one, as {was.name} was",
            remedy="If this device is the real rig, set simulated = false (in its settings or DeviceInfo). If it is a "
            "simulation, start a new session with it.",
        )
    if was.simulated and not info.simulated:
        raise DeviceError(
            "the session was run with a simulated device, so its trials are not from a person",
            got=info.name,
            expected=f"a simulated one, as {was.name} was",
            remedy="Start a new session: isiw run CONFIG, or in Python isiw.Session(device, strategy, log=NEW_PATH), "
            "or isiw.open_session(strategy, log=NEW_PATH).",
        )


def require_same_person(subject: str, logged: Header) -> None:
    """Raise if the trials of a log that a loop of the lab's own continues are another person's, or nobody's."""
    require_as_real(DeviceInfo(OWN_LOOP, logged.space.reference), logged.device)
    if subject and logged.subject and subject != logged.subject:
        raise InvalidValueError(
            "the log is another person's",
            got=subject,
            expected=logged.subject,
            remedy="Begin a log of its own for each person: isiw.open_session(strategy, log=NEW_PATH, subject=...).",
        )


def _differing_text(replayed: Replayed, header: Header) -> str:
    return (
        f"The session was logged with {versions_text(header)}, log schema {header.schema_version}. With the versions "
        f"installed here the strategy would have asked something else in {len(replayed.differing)} of "
        f"{len(replayed.trials)} trials. The logged trials count as they were; asks from here on may differ from those "
        "of an uninterrupted session."
    )


def _resumption(record: SessionRecord, replayed: Replayed, limits: Limits) -> Event:
    """The event that logs a resumption."""
    was_s, now_s = record.header.limits.iti_s, limits.iti_s
    sentences = [f"Resumed after {len(replayed.trials)} trials."]
    if replayed.differing:
        sentences.append(_differing_text(replayed, record.header))
    if replayed.unknown:
        numbers = ", ".join(str(trial.index) for trial in replayed.unknown)
        sentences.append(f"Outcome unknown: {numbers}.")
    if was_s != now_s:
        sentences.append(f"At least {now_s:g} s between two stimuli from here on; it was {was_s:g} s.")
    if len(changed_after(record.events)) > MOST_NOTED:  # earlier versions took more
        sentences.append(f"{MANY_CHANGES}")
    last = len(replayed.trials) - 1 if replayed.trials else None
    return Event(kind="resume", trial=last, text=" ".join(sentences))
