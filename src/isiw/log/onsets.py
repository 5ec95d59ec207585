"""When each stimulus of a session was about to be delivered."""

from __future__ import annotations

from typing import NamedTuple

from isiw.log.schema import Intent


class Onset(NamedTuple):
    """When a stimulus was about to be delivered.

    Args:
        onset_s: since the first one of the log, by the session's clock [s].
        at_ns: when its intent was logged [ns since 1970].
    """

    onset_s: float
    at_ns: int


class Onsets:
    """The onsets of a log whose intents are told one after the other.

    A session's clock begins anew where the session is resumed, so the time between the stimuli before and after that is
    the log's, as it is where the session's clock stood still.
    """

    def __init__(self) -> None:
        self.by_trial: dict[int, Onset] = {}
        self._last: Onset | None = None
        self._clock_s: float | None = None

    def take(self, intent: Intent, at_ns: int) -> None:
        """Take the next intent; one that is told once more for the same trial counts."""
        self._last = Onset(self._onset_s(intent.t_s, at_ns), at_ns)
        self._clock_s = intent.t_s
        self.by_trial[intent.trial] = self._last

    def refused(self) -> None:
        """Take note that the last stimulus was not given: where nothing was given before, the next is the first one."""
        if len(self.by_trial) == 1:
            self.by_trial.clear()
            self._last = None

    def resumed(self) -> None:
        """Take note that the session was resumed."""
        self._clock_s = None

    def _onset_s(self, clock_s: float, at_ns: int) -> float:
        if self._last is None:
            return 0.0
        if self._clock_s is not None and clock_s > self._clock_s:
            return self._last.onset_s + clock_s - self._clock_s
        return self._last.onset_s + max(0.0, (at_ns - self._last.at_ns) / 1e9)
