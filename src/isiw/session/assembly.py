"""Assembling a session, and its header: from a device, a strategy and options to parts that have what they need."""

from __future__ import annotations

import importlib.metadata
import os
import platform
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NamedTuple, TypedDict

import isiw
from isiw import schedule
from isiw.checks import code, deadline, patience
from isiw.devices.clock import Clock
from isiw.devices.limits import USUAL_ITI_S, Limits
from isiw.devices.protocol import VERBS, Device
from isiw.errors import InvalidValueError, StrategyError
from isiw.intervention import Intervention
from isiw.log.headers import FirstStep, Header, StrategyRecipe
from isiw.log.places import log_of
from isiw.log.writer import now
from isiw.native.engine import version as engine_version
from isiw.pairing.agenda import Agenda
from isiw.pairing.fitting import require_possible, require_settable
from isiw.session.blocks import Blocks
from isiw.session.console import OperatorConsole
from isiw.session.earlier import Earlier
from isiw.session.examination import WindowExamination, examination_of
from isiw.session.intensities import has_several, require_intensities
from isiw.session.pausing import Pausing
from isiw.session.rig import Rig, Safeguards, require_matching
from isiw.session.sink import SessionUpdate, Sink
from isiw.session.stated import require_visit
from isiw.session.steps import Steps
from isiw.signals.limits import SignalLimits
from isiw.signals.tap import TapResponses
from isiw.signals.watch import Watch
from isiw.strategy.decisions import stimuli_left
from isiw.strategy.strategy import Strategy
from isiw.visit import Visit, VisitProtocol

ESTIMATE_VERSION: Final = 8
ENGINE_VERSION: Final = 4
"""Which prior a session learns by, and which engine computes it, for its header."""

_PACKAGES = ("numpy", "torch", "botorch", "gpytorch")
_version = cache(importlib.metadata.version)  # which reads a file


def versions() -> dict[str, str]:
    """The versions that what a strategy asks depends on, by package."""
    installed = {package: _version(package) for package in _PACKAGES}
    return {"isiw": isiw.__version__, "python": platform.python_version(), **installed, "engine": engine_version()}


def require_known(call: str, options: Mapping[str, Any], kind: type) -> None:
    """Raise as Python does if a call has options that it does not know."""
    if unknown := options.keys() - kind.__annotations__.keys():
        raise TypeError(f"{call}() got an unexpected keyword argument {min(unknown)!r}")


_OPTIONAL_PARTS: Final = {"limits": Limits, "visit": Visit, "protocol": VisitProtocol, "intervention": Intervention}


def require_parts(log: object, options: Mapping[str, Any] = MappingProxyType({}), **parts: tuple[object, type]) -> Path:
    """The log's path; raise where a part of a session is something else than it should be."""
    stated = {name: (options[name], kind) for name, kind in _OPTIONAL_PARTS.items() if options.get(name) is not None}
    for name, (part, kind) in (parts | stated).items():
        if isinstance(part, type) or not isinstance(part, kind):
            expected = f"an isiw.{kind.__name__}" + (f", which has {', '.join(VERBS)}" if kind is Device else "")
            remedy = f"Make one: {part.__name__}()." if isinstance(part, type) else None
            raise InvalidValueError(f"a session cannot use this {name}", got=part, expected=expected, remedy=remedy)
    if not isinstance(log, str | os.PathLike):
        raise InvalidValueError("a session needs a log", got=log, expected='a path, such as "P07.mcap"')
    return log_of(Path(log))


def require_new(strategy: Strategy, trials: int = 0) -> None:
    """Raise if a strategy knows of more trials than a session has."""
    if strategy.delivered > trials:
        raise StrategyError(
            "the strategy knows of trials that are not this session's",
            got=f"{strategy.delivered} trials",
            expected=f"{trials} trials",
            remedy="Make a new one, or give the session strategy.restarted().",
        )


def require_fitting(strategy: Strategy, header: Header) -> None:
    """Raise if the visit states another intensity than the strategy, or the limits end the strategy's plan early."""
    require_visit(header.visit, header.strategy.settings.get("intensity_pct_rmt"))
    require_intensities(strategy, header)
    planned, most, before = strategy.stimuli_planned, header.limits.max_pulses, header.given_before
    if before >= most:
        raise InvalidValueError(
            "the earlier trials of this visit have used up the limit of stimuli, so that none could follow",
            got=f"max_pulses = {most}, {before} stimuli given before",
            remedy="Write a larger max_pulses under [limits] if your ethics approval allows it.",
        )
    if header.intervention is not None:
        plan, several = header.intervention.plan, has_several(strategy, header)
        require_settable(plan, header.limits, header.device, searched_several=several)
        require_possible(header.intervention.plan, header.limits, before, header.seed)
        return
    if planned is None and any(trial.intensity_pct_rmt is not None for trial in strategy.earlier):
        planned = stimuli_left(strategy.stopping, 0)  # who plans pulses over the curve plans the pairs after them
    if planned is None or (needed := schedule.stimuli_for(header.protocol, planned) + before) <= most:
        return
    name, planned = strategy.recipe.name or type(strategy.acquisition).__name__, planned + before
    raise InvalidValueError(
        f"the plan of {name} does not fit into the limits",
        got=f"max_pulses = {most}" + (f", {before} of them given before the session" if before else ""),
        expected=f"at least {needed}, its control trials among them" if needed > planned else f"at least {needed}",
        remedy=f"Write max_pulses = {needed} under [limits] (in Python Limits.of_space(space, max_pulses={needed})), "
        "or a smaller max_trials under [strategy.settings], which ends the plan there.",
    )


def header_of(strategy: Strategy, **details: Any) -> Header:
    """The header of a session that begins now."""
    recipe, limit_mv = strategy.recipe, strategy.detection_limit_mv
    # Of a user's own objects nothing else is known; what is learnt from the log later needs to know it.
    known = {} if recipe.name or limit_mv is None else {"detection_limit_mv": limit_mv}
    logged = StrategyRecipe(name=recipe.name, seed=recipe.seed, settings={**recipe.settings, **known})
    return Header(
        **begun(recipe.seed),
        strategy=logged,
        space=strategy.space,
        belief_version=ESTIMATE_VERSION,
        engine_version=ENGINE_VERSION,
        earlier=strategy.earlier,
        earlier_changed=strategy.earlier_changed,
        earlier_given=strategy.earlier_given,
        earlier_same_level=bool(strategy.earlier) and strategy.same_level,
        **details,
    )


def begun(seed: int) -> dict[str, Any]:
    """Fields of every header of something that begins now."""
    return {
        "isiw_version": isiw.__version__,
        "created": now().isoformat(timespec="seconds"),
        "seed": seed,
        "versions": {name: version for name, version in versions().items() if name != "isiw"},
    }


class Changeable(TypedDict, total=False):
    """Options of a session that begins, and of one that is resumed."""

    limits: Limits | None
    signals: SignalLimits | None
    clock: Clock | None
    on_trial: Callable[[SessionUpdate], None] | None
    timeout_s: float | None
    ask_deadline_s: float | None
    safeguards: Safeguards | None


class ResumeOptions(Changeable, total=False):
    """Options of a session that is resumed."""

    lost_pulses: int | None
    verify: bool
    replayed: Callable[[int], None]


class _Described(TypedDict, total=False):
    subject: str
    config: Mapping[str, Any] | None
    visit: Visit | None
    protocol: VisitProtocol | None


class Options(Changeable, _Described, total=False):
    """Options of a session that begins."""

    intervention: Intervention | None
    first_step: FirstStep | None


class OwnLoopOptions(_Described, total=False):
    """Options of a session whose loop is the lab's own."""

    limits: Limits | None
    clock: Clock | None
    lost_pulses: int | None
    on_doubt: Callable[[str], None] | None


class Parts(NamedTuple):
    """The parts of a session."""

    log_path: Path
    header: Header
    limits: Limits
    safeguards: Safeguards
    sink: Sink
    rig: Rig
    examination: WindowExamination
    pausing: Pausing
    steps: Steps


def assembled(
    console: OperatorConsole, device: Device, strategy: Strategy, log: str | Path, earlier: Earlier, options: Options
) -> Parts:
    """The parts of a session that an operator's console acts on; arguments and errors are those of `Session`."""
    require_known("Session", options, Options)
    path = require_parts(log, options, device=(device, Device), strategy=(strategy, Strategy))
    safeguards, protocol = options.get("safeguards") or Safeguards(), options.get("protocol") or VisitProtocol()
    limits = (options.get("limits") or Limits.of_space(strategy.space)).stated(USUAL_ITI_S)
    intervention = options.get("intervention")
    sink = Sink(options.get("on_trial"), hides=intervention.hides if intervention else None)
    noted = options.get("visit") or Visit()
    rig = Rig(device, limits, options.get("clock"), safeguards, sink, away=console.away, noted=noted)
    require_matching(rig.info, strategy, protocol)
    header = header_of(
        strategy,
        subject=code("subject", options.get("subject", "")),
        visit=noted,
        protocol=protocol,
        limits=limits,
        device=rig.info,
        signals=options.get("signals") or SignalLimits(),
        timeout_s=patience("timeout_s", options.get("timeout_s", 30.0)),
        ask_deadline_s=deadline("ask_deadline_s", options.get("ask_deadline_s")),
        config=dict(options.get("config") or {}),
        **({} if intervention is None else {"kind": "intervention", "intervention": intervention}),
        first_step=options.get("first_step"),
    ).model_copy(update=dict(earlier.kept))
    if safeguards.earlier_logs is not None and not header.subject:
        raise InvalidValueError(
            "earlier logs count for the same subject only, and there is none", remedy="Give the session a subject."
        )
    examination = examination_of(strategy, sink, earlier.trials, earlier.events, rig.interrupts.freely)
    pausing = Pausing(rig, examination, console.asking)
    watch = Watch(header.space, header.signals, limits.max_consecutive_mistrials, header.detection_limit_mv)
    if earlier.first_records:
        paused_for = [event.finding for event in earlier.events if event.kind == "pause" and event.finding is not None]
        watch = watch.resumed(earlier.trials, paused_for)
    taps = earlier.taps(header.signals) if earlier.taps else TapResponses(header.signals.mep_window_ms)
    steps = Steps(examination, rig, sink, pausing, watch, header, safeguards.backoffs_s, taps)
    if intervention is not None:
        strategy.only_counts = True

        def attended() -> bool:
            attended = console.reads_keys or bool(sink.followers)
            return attended or safeguards.on_pause is not None or not rig.info.simulated

        steps.keep_to(Blocks(Agenda(intervention, strategy, strategy.seed), rig.clock, attended))
    return Parts(path, header, limits, safeguards, sink, rig, examination, pausing, steps)
