"""Replaying a log: its strategy is made again, and told everything that the log holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from isiw.errors import ConfigError, InvalidValueError, OtherVersionsWarning, StrategyError, warn
from isiw.log.reader import SessionRecord
from isiw.log.schema import SCHEMA_VERSION, Event, Header, Intent, StrategyRecipe
from isiw.log.verdicts import VERDICTS, under
from isiw.session.examination import learn, relearned
from isiw.session.header import versions
from isiw.strategy.catalogue import known_settings, remade_strategy, settings_for
from isiw.strategy.strategy import Strategy
from isiw.text import plain
from isiw.trials import Trial, TrialTable

_COMPARED_AT_EACH_END = 50

_RENAMED: Final = {"zero_below_mv": "threshold_mv"}
"""Settings by the names that earlier versions logged them under."""


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

    What an operator said about a trial holds from then on; asks before it are compared as they were made. Of a long
    session the first and the last asks are compared: the last ones depend on all that was told before.

    Args:
        record: the log.
        strategy: the session's strategy before its first trial.
        verify: whether to compare what the strategy asks with what it asked then.

    Raises:
        StrategyError: it has another design space, or asks something else, although the versions are those that were
            logged.
    """
    _require_same_space(strategy, record.header)
    told: list[Trial] = []
    differing: list[int] = []
    first = record.header.asks_from
    by_fallback = {event.trial for event in record.events if event.kind == "fallback"}
    last = max((intent.trial for intent in record.intents), default=0)
    for entry in record.history:
        if isinstance(entry, Intent):
            # Behind a lost trial the strategy knew more than the log does.
            comparable = (
                entry.isi_ms is not None
                and entry.trial == len(told)
                and entry.trial >= first
                and entry.trial not in by_fallback
            )
            near_an_end = min(entry.trial - first, last - entry.trial) < _COMPARED_AT_EACH_END
            if verify and comparable and near_an_end and (asked_ms := strategy.ask()) != entry.isi_ms:
                _require_other_versions(entry, asked_ms, record.header)
                differing.append(entry.trial)
        elif isinstance(entry, Trial):
            learn(strategy, entry)
            told.append(entry)
        elif isinstance(entry, Event) and entry.kind in VERDICTS:
            # In the order of telling, in which a trial that was lost stands behind later ones.
            told = [under(trial, entry) for trial in told]
            strategy = relearned(strategy, told)
    unknown = record.unknown_trials
    for trial in unknown:
        learn(strategy, trial)
    table = TrialTable(tuple(sorted((*told, *unknown), key=lambda trial: trial.index)))
    return Replayed(strategy, table, unknown, tuple(differing), len(table) if differing or not verify else first)


def strategy_of(header: Header) -> Strategy:
    """The strategy of a logged session, before its first trial.

    Warns:
        OtherVersionsWarning: it has settings of an earlier version that this one does not know.
    """
    recipe = header.strategy
    if not recipe.name:
        raise StrategyError(
            "the session's strategy was built from a user's own objects, which no log can hold",
            remedy="Build the same strategy again and hand it over: isiw.resume(path, device, strategy).",
        )
    settings = known_settings(recipe.name, {"engine": "torch"}) | recipe.settings  # the one there was before others
    if header.schema_version < SCHEMA_VERSION:
        settings = _known_settings(recipe.model_copy(update={"settings": settings}))
    return remade_strategy(recipe.name, header.space, recipe.seed, **settings)


def _known_settings(recipe: StrategyRecipe) -> dict[str, Any]:
    """The settings of an earlier version that this one knows; a warning names the others."""
    known = {}
    settings = _renamed(recipe.settings)
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


def _renamed(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings by the names that they have now."""
    renamed = {_RENAMED.get(key, key): value for key, value in settings.items()}
    if "max_iterations" in renamed:  # which left the initial trials out
        renamed["max_trials"] = renamed["initial"] + renamed.pop("max_iterations")
    return renamed


def _require_same_space(strategy: Strategy, header: Header) -> None:
    if strategy.space != header.space:
        raise StrategyError(
            "the strategy has another design space than the session",
            got=str(strategy.space),
            expected=str(header.space),
            remedy="Make it with space=isiw.read_session(LOG).header.space.",
        )


def _require_other_versions(intent: Intent, asked_ms: float, header: Header) -> None:
    """Raise where the strategy has no reason to ask something else than it did."""
    if header.schema_version == SCHEMA_VERSION and versions() == {**header.versions, "isiw": header.isiw_version}:
        raise StrategyError(
            f"the strategy does not ask again what was asked in trial {intent.trial}",
            got=f"{asked_ms:g} ms",
            expected=f"{intent.isi_ms} ms, as logged with {versions_text(header)}",
            remedy="Resume with the same strategy and on the same machine, or without verification: the logged trials "
            "are then told as they are.",
        )


def versions_text(header: Header) -> str:
    """The versions that a session was logged with."""
    logged = {"isiw": header.isiw_version, **header.versions}
    return plain(", ".join(f"{name} {version}" for name, version in logged.items()))
