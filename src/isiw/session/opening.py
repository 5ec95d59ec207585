"""Opening a session whose loop is the lab's own, or going on with one from its log."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from isiw.checks import text
from isiw.devices.clock import Clock, MonotonicClock
from isiw.devices.limits import Limits
from isiw.devices.protocol import DeviceInfo
from isiw.errors import InvalidValueError, StrategyError
from isiw.log.durable import log_exists
from isiw.log.headers import Header
from isiw.log.kinds import OWN_LOOP, require_session
from isiw.log.reader import SessionRecord, read_salvaged
from isiw.log.salvage import Salvage, salvage
from isiw.log.writer import LogWriter
from isiw.session.assembly import header_of, require_parts, require_room
from isiw.session.examination import estimate_record
from isiw.session.recorder import Recorder
from isiw.session.replay import require_same_person, taken_up
from isiw.signals.limits import SignalLimits
from isiw.strategy.strategy import Strategy
from isiw.trials import Trial
from isiw.visit import Visit, VisitProtocol


def open_session(  # noqa: PLR0913 - all but two are keyword-only
    strategy: Strategy,
    log: str | Path,
    *,
    resume: bool = False,
    earlier: Iterable[Trial] = (),
    limits: Limits | None = None,
    clock: Clock | None = None,
    subject: str = "",
    visit: Visit | None = None,
    protocol: VisitProtocol | None = None,
    config: Mapping[str, Any] | None = None,
    lost_pulses: int | None = None,
    on_doubt: Callable[[str], None] | None = None,
) -> Recorder:
    """Open a session whose loop is your own: ask it for ISIs, and tell it what came of them.

    Args:
        strategy: proposes ISIs and learns; of a session that goes on, made with the same settings and seed.
        log: where the log is; it must not exist yet, unless the session goes on.
        resume: whether to go on with the log where there is one. What was asked and has no outcome in it becomes a
            mistrial.
        earlier: trials of this person that were delivered before, such as the `record.table` of a log or an analysis:
            the strategy learns them before its first ask, as `Strategy.learn_all` does, and nothing counts them.
        limits: what may be asked; the strategy's space and 200 pulses by default. Nothing waits between stimuli unless
            their `min_iti_s` is stated. Of a session that goes on, the logged ones by default. Limits of the coil and
            of the intensity allow nothing, as nobody reports these here.
        clock: tells the time, and waits in `ask` until the interval, the rest and the period of the limits have passed,
            before the first stimulus, too, as nobody knows what came before.
        subject: the person's code, for the log; of a session that goes on, the logged one by default.
        visit: what is noted about the visit, for the log; of a session that goes on, the logged one by default.
        protocol: intervals, blocks and rests, which `ask` waits for; of a session that goes on, the logged one by
            default. Control trials are the loop's own: `tell(None, …)` is TMS alone.
        config: anything that should be kept in the log, as TOML values; of a session that goes on, what is logged by
            default.
        lost_pulses: as for `isiw.resume`: needed where the end of the log is missing.
        on_doubt: called with what looks like a slip in what was told, or like a rig that needs somebody to look; by
            default a warning.

    Raises:
        DamagedLogError: the log's end is missing, and `lost_pulses` is not given.
        DeviceError: the log is of a simulated device.
        InvalidValueError: `lost_pulses` is no number of stimuli, or the log's end is there; a subject that is no text,
            or another than the log's; a protocol with control trials; a rest or a period that limits nothing, a limit
            on intensity or coil temperature, which nobody reports here, or limits that do not hold the strategy's plan.
        LogError: there is a log already, or it cannot be written or read.
        StrategyError: the strategy knows of trials already, or asks something else than the log says it asked.

    Warns:
        OtherVersionsWarning: with other versions than those that were logged the strategy asks something else.
    """
    path = require_parts(
        log,
        strategy=(strategy, Strategy),
        limits=(limits, Limits | None),
        visit=(visit, Visit | None),
        protocol=(protocol, VisitProtocol | None),
    )
    if strategy.delivered:
        raise StrategyError(
            "the strategy knows of trials that are not this session's",
            got=f"{strategy.delivered} trials",
            remedy="Make it again, or give the session strategy.restarted().",
        )
    if trials := tuple(earlier):
        strategy.learn_all(trials)
    header = _header(
        strategy,
        subject=text("subject", subject),
        visit=visit or Visit(),
        protocol=_without_controls(protocol or VisitProtocol()),
        limits=(limits or Limits.of_space(strategy.space)).stated(0.0),
        config=dict(config or {}),
    )
    _require_reported(header.limits)
    header.limits.require_effect()
    header.protocol.require_effect(header.limits.iti_s)
    clock = clock or MonotonicClock()
    if not (resume and log_exists(path)):
        require_room(strategy, header)
        return Recorder(strategy, LogWriter.create(path, header), header, clock, on_doubt=on_doubt)
    given = {"subject": subject, "visit": visit, "protocol": protocol, "limits": limits, "config": config}
    changes = {name: getattr(header, name) for name, value in given.items() if value is not None and value != ""}
    salvaged = salvage(path)
    return own_loop_resumed(salvaged, read_salvaged(salvaged), strategy, changes, lost_pulses, clock, on_doubt)


def own_loop_resumed(
    salvaged: Salvage,
    record: SessionRecord,
    strategy: Strategy | None,
    changes: Mapping[str, Any],
    lost_pulses: int | None,
    clock: Clock,
    on_doubt: Callable[[str], None] | None,
) -> Recorder:
    """The session of a log, from where it ends, with the fields of its header that are said otherwise."""
    require_session(record.path, record.header)
    record.require_read()
    logged = record.header
    require_same_person(changes.get("subject", ""), logged)
    details = {name: getattr(logged, name) for name in ("subject", "visit", "protocol", "limits", "config")}
    details |= changes
    _require_reported(details["limits"])
    strategy, earlier = taken_up(salvaged, record, strategy, details["limits"], lost_pulses)
    header = _header(strategy, **details).model_copy(update=dict(earlier.kept))
    writer = earlier.open_log(header)
    for first in earlier.first_records:
        writer.append(first)
    if record.is_judged_since:
        writer.append(estimate_record(strategy, len(earlier.trials) - 1, strategy.decision(), None))
    writer.sync()
    return Recorder(strategy, writer, header, clock, earlier, on_doubt)


def _header(strategy: Strategy, **details: Any) -> Header:
    device = DeviceInfo(OWN_LOOP, strategy.space.reference)
    return header_of(strategy, device=device, signals=SignalLimits(), **details)


def _require_reported(limits: Limits) -> None:
    """Raise where limits need what a loop of one's own reports nothing of: such a session could never ask."""
    states = {"intensity_pct_mso": limits.intensity_pct_mso, "max_coil_c": limits.max_coil_c}
    given = {name: value for name, value in states.items() if value is not None}
    if given:
        raise InvalidValueError(
            "a loop of one's own reports neither intensity nor coil temperature, so these limits cannot be kept",
            got=given,
            remedy="Keep them yourself, and state others: limits=isiw.Limits.of_space(space, min_iti_s=5).",
        )


def _without_controls(protocol: VisitProtocol) -> VisitProtocol:
    if protocol.tms_alone or protocol.tap_alone:
        raise InvalidValueError(
            "in a loop of one's own the protocol cannot have control trials, as ask() answers with an ISI",
            got=protocol,
            remedy="Give TMS alone whenever you like, and tell it with tell(None, mep_mv). isiw.Session interleaves "
            "control trials itself.",
        )
    return protocol
