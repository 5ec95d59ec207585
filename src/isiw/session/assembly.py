"""Assembling a session: from a device, a strategy and options to parts that have what they need when they are made."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypedDict

from isiw.checks import deadline, number, text
from isiw.devices.clock import Clock
from isiw.devices.limits import Limits
from isiw.devices.protocol import Device
from isiw.errors import InvalidValueError
from isiw.log.schema import Header
from isiw.session.asking import Asking
from isiw.session.desk import Desk, Operated
from isiw.session.examination import WindowExamination, examination_of
from isiw.session.header import Earlier, header_of, require_parts
from isiw.session.pausing import Pausing
from isiw.session.rig import Rig, require_matching
from isiw.session.safeguards import Safeguards
from isiw.session.sink import Sink
from isiw.session.steps import Steps
from isiw.session.updates import SessionUpdate
from isiw.signals.limits import SignalLimits
from isiw.signals.watch import Watch
from isiw.strategy.strategy import Strategy
from isiw.visit import Visit, VisitProtocol


class ResumeOptions(TypedDict, total=False):
    """What can be said of a session that begins, and otherwise than before of one that is resumed."""

    limits: Limits | None
    signals: SignalLimits | None
    clock: Clock | None
    on_trial: Callable[[SessionUpdate], None] | None
    timeout_s: float | None
    ask_deadline_s: float | None
    safeguards: Safeguards | None


class Options(ResumeOptions, total=False):
    """What can be said of a session that begins."""

    subject: str
    config: Mapping[str, Any] | None
    visit: Visit | None
    protocol: VisitProtocol | None


class Parts(NamedTuple):
    """What a session consists of."""

    log_path: Path
    header: Header
    limits: Limits
    safeguards: Safeguards
    sink: Sink
    rig: Rig
    examination: WindowExamination
    asking: Asking
    pausing: Pausing
    steps: Steps
    desk: Desk


def assembled(
    operated: Operated, device: Device, strategy: Strategy, log: str | Path, earlier: Earlier, options: Options
) -> Parts:
    """The parts of a session, which its operator's keys act on; arguments and errors are those of `Session`."""
    if unknown := options.keys() - Options.__annotations__.keys():
        raise TypeError(f"Session() got an unexpected keyword argument {min(unknown)!r}")
    visit, protocol, limits = options.get("visit"), options.get("protocol"), options.get("limits")
    path = require_parts(
        log,
        device=(device, Device),
        strategy=(strategy, Strategy),
        limits=(limits, Limits | None),
        visit=(visit, Visit | None),
        protocol=(protocol, VisitProtocol | None),
    )
    safeguards, protocol = options.get("safeguards") or Safeguards(), protocol or VisitProtocol()
    limits = limits or Limits.of_space(strategy.space)
    asking, sink = Asking(), Sink(options.get("on_trial"))
    desk = Desk(operated, asking)
    rig = Rig(device, limits, options.get("clock"), safeguards, sink, away=desk.away)
    require_matching(rig.info, strategy, protocol)
    header = header_of(
        strategy,
        subject=text("subject", options.get("subject", "")),
        visit=visit or Visit(),
        protocol=protocol,
        limits=limits,
        device=rig.info,
        signals=options.get("signals") or SignalLimits(),
        timeout_s=number("timeout_s", options.get("timeout_s", 30.0), above=0),
        ask_deadline_s=deadline("ask_deadline_s", options.get("ask_deadline_s")),
        config=dict(options.get("config") or {}),
    ).model_copy(update=dict(earlier.kept))
    if safeguards.earlier_logs is not None and not header.subject:
        raise InvalidValueError(
            "earlier logs count for the same subject only, and there is none", remedy="Give the session a subject."
        )
    examination = examination_of(strategy, sink, earlier.trials, earlier.events, rig.interrupts.freely)
    pausing = Pausing(rig, examination, asking)
    watch = Watch(header.space, header.signals, limits.max_consecutive_mistrials, header.detection_limit_mv)
    if earlier.first_records:
        paused_for = [event.finding for event in earlier.events if event.kind == "pause" and event.finding is not None]
        watch = watch.resumed(earlier.trials, paused_for)
    steps = Steps(examination, rig, sink, pausing, watch, header, safeguards.backoffs_s)
    return Parts(path, header, limits, safeguards, sink, rig, examination, asking, pausing, steps, desk)
