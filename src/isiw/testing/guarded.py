"""A device under check, driven as a session drives it: within limits and deadlines, and disarmed at every signal."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from isiw.devices.clock import Clock
from isiw.devices.deadlines import PunctualDevice
from isiw.devices.limits import Limits
from isiw.devices.protocol import Answer, Device, DeviceInfo, Readiness, readiness_of
from isiw.errors import DeviceError, DeviceTimeoutError, NotDelivered, StillArmedError, error_text
from isiw.session.rig import Rig, Safeguards, exclusive
from isiw.session.sink import Sink
from isiw.testing.suites import broken, require
from isiw.trials import Stimulus


@dataclass(frozen=True)
class CheckPace:
    """The pace of the deliveries of a check; the limits may ask for longer waits."""

    timeout_s: float
    iti_s: float
    limits: Limits
    clock: Clock
    given_s: list[float] = field(default_factory=list)  # when each delivery ended, of all devices of the check


class Guarded:
    """A device that is checked, behind the guards of a session."""

    def __init__(self, device: Device, pace: CheckPace) -> None:
        self._device, self._pace, self._delivered = device, pace, 0
        self._kept = _KeptDisarmed(device)
        self._sink = Sink()
        self._rig = Rig(self._kept, pace.limits, pace.clock, Safeguards(), self._sink, waits_for_nobody=True)

    @property
    def info(self) -> DeviceInfo:
        """The device's description."""
        return self._rig.info

    @contextmanager
    def exclusive(self) -> Iterator[None]:
        """Within, no session drives the device, and every signal disarms it and ends the check."""
        with exclusive(self._device, self._rig.info), self._rig.interrupts:
            yield
        faults = "; ".join(self._sink.faults)
        require(not faults, "stop and unstage work in any state", faults)

    @contextmanager
    def armed(self, *, kept_disarmed: bool = False) -> Iterator[None]:
        """Within, the device is staged; behind it, it is disarmed and let go of, whatever happened."""
        self._kept.now = kept_disarmed
        now_s = self._pace.clock.now_s()
        self._rig.begin(self._delivered, [now_s - given_s for given_s in self._pace.given_s])
        with self._rig.armed():
            yield

    def disarm(self) -> None:
        """Disarm the staged device, and let stimuli get through to it all the same."""
        self._rig.disarm()
        self._kept.now = True
        self._rig.stage()

    def deliver(self, stimulus: Stimulus) -> tuple[Answer, float]:
        """Deliver a stimulus, as a session tries again what is refused before firing, and say how long it took [s]."""
        for backoff_s in Safeguards().backoffs_s:
            try:
                return self._tried(stimulus)
            except NotDelivered:
                self._sleep(backoff_s)
        return self._tried(stimulus)

    def require_refusal(self, when: str) -> None:
        """Raise if the disarmed device does not refuse to deliver."""
        try:
            self._tried(Stimulus(0, None))
        except DeviceError:
            return
        raise broken(f"deliver raises a DeviceError {when}", "it delivered and raised nothing")

    def require_stop(self) -> None:
        """Raise if `stop` fails before anything is armed; once the device is armed that would be too late."""
        punctual = PunctualDevice(self._device)
        try:
            punctual.stop()
        except StillArmedError as error:
            raise broken("stop works in any state", error_text(error)) from error
        finally:
            punctual.release_thread()

    def _tried(self, stimulus: Stimulus) -> tuple[Answer, float]:
        self._sleep(self._pace.iti_s)
        while (wait_s := self._rig.limited.wait_s()) > 0:
            self._sleep(wait_s)
        began_s, timeout_s = time.monotonic(), self._pace.timeout_s
        try:
            answer = self._rig.limited.deliver(stimulus, timeout_s)
        except DeviceTimeoutError as error:
            if (spent_s := time.monotonic() - began_s) > timeout_s:
                seen = f"nothing after {spent_s:.3g} s, when it timed out and was disarmed"
                raise broken(_in_time(timeout_s), seen) from error
            raise
        self._delivered += 1
        self._pace.given_s.append(self._pace.clock.now_s())
        spent_s = time.monotonic() - began_s
        require(spent_s <= timeout_s, _in_time(timeout_s), f"{spent_s:.3g} s")
        return answer, spent_s

    def _sleep(self, duration_s: float) -> None:
        self._rig.interrupts.freely(self._pace.clock.sleep_s, duration_s)


def _in_time(timeout_s: float) -> str:
    return f"deliver returns or raises within its timeout of {timeout_s:g} s"


class _KeptDisarmed:
    """A device from which `stage` can be kept, for whoever asks whether it refuses what gets through to it then."""

    def __init__(self, device: Device) -> None:
        self._device, self.now = device, False

    def describe(self) -> DeviceInfo:
        return self._device.describe()

    def stage(self) -> None:
        if not self.now:
            self._device.stage()

    def readiness(self) -> Readiness:
        return readiness_of(self._device)

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        try:
            return self._device.deliver(stimulus, timeout_s)
        except DeviceError as error:
            if not self.now:
                raise
            raise NotDelivered(error_text(error)) from error  # disarmed, it has delivered nothing

    def stop(self) -> None:
        self._device.stop()

    def unstage(self) -> None:
        self._device.unstage()
