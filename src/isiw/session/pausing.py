"""Pauses: disarmed at once, and armed again only where somebody says so."""

from __future__ import annotations

from typing import NamedTuple

from isiw.findings import Kind
from isiw.session.asking import Asking
from isiw.session.journal import Journal
from isiw.session.operator import goes_on
from isiw.session.rig import Rig
from isiw.session.safeguards import Safeguards

__all__ = ["Pause", "Pausing"]

_INTERRUPTED = "Interrupted by the operator."


class Pause(NamedTuple):
    """A pause that waits to be decided: its number in the session, from 1, and why."""

    number: int
    reason: str


class Pausing:
    """Whether and why a session is to pause, and how it goes on.

    Args:
        rig: is disarmed, and armed again.
        journal: where pauses are written.
        safeguards: `on_pause` decides how a session goes on, or the operator in the terminal.
    """

    def __init__(self, rig: Rig, journal: Journal, safeguards: Safeguards) -> None:
        self._rig, self._journal = rig, journal
        self.decide = safeguards.on_pause or goes_on
        self.reason: str | None = None
        self.kind: Kind | None = None
        self.waiting: Pause | None = None
        self.asking = Asking()

    @property
    def due(self) -> bool:
        """Whether the session is to pause before the next stimulus."""
        return self.reason is not None or self._rig.interrupts.heard

    def now(self, reason: str) -> None:
        """Disarm, and pause before the next stimulus; from any thread.

        Args:
            reason: why, for the operator and the log.
        """
        self.reason, self.kind = reason, None
        self._rig.disarm()

    def end(self, reason: str) -> None:
        """Disarm, and end before the next stimulus, whatever is answered to a pause; from any thread.

        Args:
            reason: why, for the log.
        """
        self.asking.end()
        self.now(reason)

    def until_decided(self) -> str | None:
        """Pause until somebody says that the session goes on; where nobody does, the reason that it ends with.

        Raises:
            KeyboardInterrupt: the operator ends the session.
        """
        rig, interrupts = self._rig, self._rig.interrupts
        rig.disarm()
        self._journal.faults(rig.faults)
        interrupts.acknowledge()
        if interrupts.ending:
            raise KeyboardInterrupt
        reason, kind, self.reason, self.kind = self.reason or _INTERRUPTED, self.kind, None, None
        self._journal.event("pause", reason, finding=kind)
        self._journal.log.sync()
        if not self._goes_on(reason):
            if interrupts.heard:
                raise KeyboardInterrupt
            return self._last(reason)
        interrupts.settle()
        self._journal.event("pause", "The operator goes on.")
        if not self.due:
            rig.stage()
        return None

    def _last(self, reason: str) -> str:
        """Why a paused session ends: what it has paused for, or what somebody said meanwhile."""
        if self.reason is not None:
            reason, self.reason = self.reason, None
            self._journal.event("pause", reason)
        return reason

    def _goes_on(self, reason: str) -> bool:
        if self.asking.over:
            return False
        self.waiting = Pause(self.asking.next(), reason)
        try:
            return self._rig.interrupts.freely(self.decide, reason) is True and not self.asking.over
        finally:
            self.waiting = None
