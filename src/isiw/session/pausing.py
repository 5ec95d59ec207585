"""Pauses: disarmed at once, and armed again only where somebody says so."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from isiw.findings import Kind
from isiw.session.asking import Asking
from isiw.session.examination import WindowExamination
from isiw.session.rig import Rig

_INTERRUPTED = "Interrupted by the operator."


class Pause(NamedTuple):
    """A pause that waits to be decided: its number in the session, from 1, and why."""

    number: int
    reason: str


class Pausing:
    """Whether and why a session is to pause, and how it goes on."""

    def __init__(self, rig: Rig, examination: WindowExamination, asking: Asking) -> None:
        self._rig, self._examination, self._asking = rig, examination, asking
        self.reason: str | None = None
        self.kind: Kind | None = None
        self.waiting: Pause | None = None

    @property
    def due(self) -> bool:
        """Whether the session is to pause before the next stimulus."""
        return self.reason is not None or self._rig.interrupts.heard

    def now(self, reason: str) -> None:
        """Disarm, and pause before the next stimulus; from any thread."""
        self.reason, self.kind = reason, None
        self._rig.disarm()

    def end(self, reason: str) -> None:
        """Disarm, and end before the next stimulus, whatever is answered to a pause; from any thread."""
        self._asking.end()
        self.now(reason)

    def until_decided(self, decide: Callable[[str], bool]) -> str | None:
        """Pause until somebody says that the session goes on; if nobody does, the reason that it ends with."""
        rig, interrupts = self._rig, self._rig.interrupts
        rig.disarm()
        self._examination.log_faults()
        interrupts.acknowledge()
        if interrupts.ending:
            raise KeyboardInterrupt
        reason, kind, self.reason, self.kind = self.reason or _INTERRUPTED, self.kind, None, None
        self._examination.event("pause", reason, finding=kind, durable=True)
        if not self._goes_on(reason, decide):
            if interrupts.heard:
                raise KeyboardInterrupt
            return self._last(reason)
        interrupts.settle()
        self._examination.event("pause", "The operator goes on.")
        if not self.due:
            rig.stage()
        return None

    def _last(self, reason: str) -> str:
        """Why a paused session ends: what it has paused for, or what somebody said meanwhile."""
        if self.reason is not None:
            reason, self.reason = self.reason, None
            self._examination.event("pause", reason)
        return reason

    def _goes_on(self, reason: str, decide: Callable[[str], bool]) -> bool:
        if self._asking.over:
            return False
        self.waiting = Pause(self._asking.next(), reason)
        try:
            return self._rig.interrupts.freely(decide, reason) is True and not self._asking.over
        finally:
            self.waiting = None
