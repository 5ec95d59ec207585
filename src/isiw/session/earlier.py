"""Where an earlier run of a session ended."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from isiw.log.headers import Header
from isiw.log.moments import Ages
from isiw.log.schema import Event, Record
from isiw.log.writer import LogWriter
from isiw.trials import TrialTable

if TYPE_CHECKING:
    from isiw.signals.limits import SignalLimits
    from isiw.signals.tap import TapResponses


@dataclass(frozen=True)
class Earlier:
    """Where an earlier run ended, and the header's fields that stay; without `first_records` there was none."""

    open_log: Callable[[Header], LogWriter]
    trials: TrialTable = field(default_factory=TrialTable)
    events: tuple[Event, ...] = ()
    kept: Mapping[str, Any] = field(default_factory=dict)
    first_records: Sequence[Record] = ()
    ages: Callable[[], Ages] = Ages
    taps: Callable[[SignalLimits], TapResponses] | None = None
    ago_s: Callable[[int], float | None] = lambda _: None
