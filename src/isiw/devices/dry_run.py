"""A rehearsal: everything of a real device but its arming and firing."""

from __future__ import annotations

import dataclasses

from isiw.devices.protocol import Device, DeviceInfo, Readiness, readiness_of, require_staged
from isiw.trials import Measurement, Stimulus


class DryRun:
    """A device that is never armed and never fires: every stimulus is answered with an MEP of 0.

    Strategy, limits, readiness, pauses and log can be tried with the rig connected. It counts as simulated; give the
    session a `MonotonicClock` to rehearse its pace, too.

    Args:
        device: the real one; only `describe` and, where it has it, `readiness` are called.
    """

    def __init__(self, device: Device) -> None:
        info = device.describe()
        self._device, self._staged = device, False
        self._info = dataclasses.replace(info, name=f"dry run of {info.name}", simulated=True, channels={})

    def describe(self) -> DeviceInfo:
        """What the device is, as a simulated one that measures MEPs."""
        return self._info

    def readiness(self) -> Readiness:
        """What the real device says about its state."""
        return readiness_of(self._device)

    def stage(self) -> None:
        """Arm nothing."""
        self._staged = True

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement:  # noqa: ARG002 - answers at once
        """Fire nothing.

        Args:
            stimulus: what would be delivered.
            timeout_s: the longest the call may take [s].
        """
        require_staged(self._info.name, staged=self._staged)
        return Measurement(0.0, stimulus.isi_ms)

    def stop(self) -> None:
        """Refuse what comes until the next `stage`."""
        self._staged = False

    unstage = stop
