"""A device made of plain functions, for lab software that already knows how to fire."""

from __future__ import annotations

from collections.abc import Callable

from isiw.devices.protocol import Answer, DeviceInfo, require_staged
from isiw.trials import Stimulus


def _nothing() -> None:
    """Arm or disarm hardware that needs neither."""


class CallbackDevice:
    """Calls your functions.

    Args:
        fire: delivers one pair of stimuli and returns a `Measurement` or a `Sweep`; takes the stimulus and the time
            allowed [s]. The ISI must be timed by hardware, never by Python.
        info: what the device is.
        arm: called by `stage`.
        disarm: called by `stop` and `unstage`; must work in any state.
    """

    def __init__(
        self,
        fire: Callable[[Stimulus, float], Answer],
        info: DeviceInfo,
        arm: Callable[[], None] = _nothing,
        disarm: Callable[[], None] = _nothing,
    ) -> None:
        self._fire, self._info, self._arm, self._disarm = fire, info, arm, disarm
        self._staged = False

    def describe(self) -> DeviceInfo:
        """The device's description."""
        return self._info

    def stage(self) -> None:
        """Arm."""
        self._arm()
        self._staged = True

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        """Fire."""
        require_staged(self._info.name, staged=self._staged)
        return self._fire(stimulus, timeout_s)

    def stop(self) -> None:
        """Disarm."""
        self._staged = False
        self._disarm()

    def unstage(self) -> None:
        """Disarm."""
        self.stop()
