"""Pauses: disarmed at once, and armed again only where somebody says so."""

from __future__ import annotations

from isiw.session.asking import Asking
from isiw.session.journal import Journal
from isiw.session.operator import goes_on
from isiw.session.rig import Rig
from isiw.session.safeguards import Safeguards

__all__ = ["Pausing"]

_INTERRUPTED = "Interrupted by the operator."


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
        self.waiting: str | None = None
        self.asking = Asking()
        self._ending = False

    @property
    def due(self) -> bool:
        """Whether the session is to pause before the next stimulus."""
        return self.reason is not None or self._rig.interrupts.heard

    def now(self, reason: str) -> None:
        """Disarm, and pause before the next stimulus; from any thread.

        Args:
            reason: why, for the operator and the log.
        """
        self.reason = reason
        self._rig.disarm()

    def end(self, reason: str) -> None:
        """Disarm, and end before the next stimulus; from any thread.

        Args:
            reason: why, for the log.
        """
        self._ending = True
        if self.waiting is None:
            self.now(reason)
            return
        self._journal.event("pause", reason)
        if self.asking.asked:
            self.asking.answer(goes_on=False)

    def until_decided(self) -> str | None:
        """Pause until somebody says that the session goes on; where nobody does, the reason that it ends with.

        Raises:
            KeyboardInterrupt: the operator ends the session.
        """
        rig, interrupts = self._rig, self._rig.interrupts
        rig.disarm()
        self._journal.faults(rig.faults)
        if interrupts.ending:
            raise KeyboardInterrupt
        interrupts.acknowledge()
        reason, self.reason = self.reason or _INTERRUPTED, None
        self._journal.event("pause", reason)
        self._journal.log.sync()
        if not self._goes_on(reason):
            if interrupts.heard:
                raise KeyboardInterrupt
            return reason
        interrupts.settle()
        self._journal.event("pause", "The operator goes on.")
        rig.stage()
        return None

    def _goes_on(self, reason: str) -> bool:
        self.waiting = reason
        try:
            return not self._ending and self._rig.interrupts.freely(self.decide, reason) and not self._ending
        finally:
            self.waiting = None
