"""Limits that no strategy, session or mistake can exceed: a wrapper around any device."""

from __future__ import annotations

import math
from dataclasses import dataclass

from isiw.checks import check_numbers, check_wholes
from isiw.design import DesignSpace
from isiw.devices.clock import Clock
from isiw.devices.protocol import Answer, Device, DeviceInfo, require_staged
from isiw.errors import InvalidValueError, LimitExceededError
from isiw.trials import Stimulus

__all__ = ["LimitedDevice", "Limits"]


@dataclass(frozen=True)
class Limits:
    """What may be delivered at most.

    Args:
        low_ms: shortest ISI on the device's reference [ms].
        high_ms: longest ISI [ms].
        min_iti_s: shortest time between two deliveries [s].
        max_pulses: largest number of deliveries in a session, failed ones included.
        max_consecutive_mistrials: after so many mistrials in a row a session pauses, so that a person can look.

    Raises:
        InvalidValueError: values that are not finite or limit nothing, or a number that is not whole.
    """

    low_ms: float
    high_ms: float
    min_iti_s: float = 5.0
    max_pulses: int = 200
    max_consecutive_mistrials: int = 3

    def __post_init__(self) -> None:
        check_numbers(self, "low_ms", "high_ms")
        check_numbers(self, "min_iti_s", least=0)
        check_wholes(self, "max_pulses", "max_consecutive_mistrials", least=1)
        if self.low_ms > self.high_ms:
            raise InvalidValueError("the limits of the ISI must ascend", got=(self.low_ms, self.high_ms))

    @classmethod
    def of_space(
        cls, space: DesignSpace, *, min_iti_s: float = 5.0, max_pulses: int = 200, max_consecutive_mistrials: int = 3
    ) -> Limits:
        """Limits that allow exactly the ISIs of a design space.

        Args:
            space: the design space.
            min_iti_s: shortest time between two deliveries [s].
            max_pulses: largest number of deliveries in a session.
            max_consecutive_mistrials: after so many mistrials in a row a session pauses.
        """
        return cls(space.low_ms, space.high_ms, min_iti_s, max_pulses, max_consecutive_mistrials)


class LimitedDevice:
    """A device that refuses what exceeds its limits, before anything is delivered.

    A delivery that fails counts like any other, because nobody knows whether the pulse left. The inter-trial interval
    runs from the moment the last attempt ended.

    Args:
        device: the device to guard.
        limits: what it may deliver.
        clock: tells the time between deliveries.
        delivered: deliveries of this session so far; where there are some, the first one now waits a whole interval.
    """

    def __init__(self, device: Device, limits: Limits, clock: Clock, *, delivered: int = 0) -> None:
        self.limits = limits
        self._device, self._clock, self._delivered = device, clock, delivered
        self._last_s = clock.now_s() if delivered else -math.inf
        self._staged = False

    @property
    def pulses_left(self) -> int:
        """How many deliveries are still allowed."""
        return max(0, self.limits.max_pulses - self._delivered)

    def wait_s(self) -> float:
        """How long until the inter-trial interval allows the next delivery [s]."""
        return max(0.0, self._last_s + self.limits.min_iti_s - self._clock.now_s())

    def check(self, stimulus: Stimulus) -> None:
        """Raise where this stimulus must not be delivered now.

        Raises:
            LimitExceededError: the number of pulses, the ISI's range, or the inter-trial interval.
        """
        limits, isi_ms = self.limits, stimulus.isi_ms
        if self._delivered >= limits.max_pulses:
            raise LimitExceededError(
                f"the limit of {limits.max_pulses} pulses is reached",
                remedy="Nothing was delivered. End the session, or start one with a higher max_pulses.",
            )
        if isi_ms is not None and not limits.low_ms <= isi_ms <= limits.high_ms:
            raise LimitExceededError(
                "the ISI is beyond the limits",
                got=isi_ms,
                expected=f"{limits.low_ms:g} to {limits.high_ms:g} ms",
                remedy="Nothing was delivered. Let the limits hold the whole design space.",
            )
        if self.wait_s() > 0:
            raise LimitExceededError(
                "the next stimulus comes too early",
                got=f"{limits.min_iti_s - self.wait_s():.3f} s since the last one",
                expected=f"at least {limits.min_iti_s:g} s",
                remedy="Nothing was delivered. Sleep for wait_s() first.",
            )

    def describe(self) -> DeviceInfo:
        """What the guarded device is."""
        return self._device.describe()

    def stage(self) -> None:
        """Get ready and arm."""
        self._device.stage()
        self._staged = True

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        """Deliver one pair of stimuli, if the limits allow it.

        Raises:
            LimitExceededError: refused; nothing was delivered.
            DeviceError: not staged, or the device failed.
        """
        require_staged(self.describe().name, staged=self._staged)
        self.check(stimulus)
        self._delivered += 1
        try:
            return self._device.deliver(stimulus, timeout_s)
        finally:
            self._last_s = self._clock.now_s()

    def stop(self) -> None:
        """Disarm; from here on nothing is delivered until the next `stage`."""
        self._staged = False
        self._device.stop()

    def unstage(self) -> None:
        """Let go of the device."""
        self._staged = False
        self._device.unstage()
