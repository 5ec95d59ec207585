"""A device that stimulates nobody, and what it stands for: a simulated person, or whatever answers stimuli."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Protocol, TypeAlias

from isiw.devices.protocol import Answer, Device, DeviceInfo, Readiness, readiness_of, require_staged
from isiw.errors import DeviceError
from isiw.trials import Measurement, Stimulus
from isiw.types import Conditioning, Reference


class Outcome(Protocol):
    """The outcome of a simulated stimulus."""

    @property
    def isi_ms(self) -> float | None:
        """The realised ISI as told [ms]; None for TMS alone."""

    @property
    def mep_mv(self) -> float:
        """Peak-to-peak amplitude of the MEP [mV]."""

    @property
    def isi_sd_ms(self) -> float:
        """SD of the realised ISI about the told one [ms]."""


Respond: TypeAlias = Callable[[float | None], Outcome]
"""Answers a commanded ISI [ms]; None is TMS alone."""


class Simulation(Protocol):
    """What a simulated device stands for: it answers one stimulus after the other, and may remember them."""

    @property
    def info(self) -> DeviceInfo:
        """What the device says about itself; it is simulated."""

    def answer(self, stimulus: Stimulus) -> Answer:
        """The outcome of the next stimulus."""


class SimulatedDevice:
    """A device that asks a simulation what came of each stimulus; it delivers nothing to anybody.

    Args:
        simulation: answers; `SimulatedPerson`, `RecordedPerson`, `RecordedTrials` and `Tapper` are there.
    """

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self._asked, self._staged = 0, False

    def describe(self) -> DeviceInfo:
        """What the device is."""
        return self.simulation.info

    def stage(self) -> None:
        """Arm."""
        self._staged = True

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:  # noqa: ARG002 - answers at once
        """The simulation's answer."""
        require_staged(self.describe().name, staged=self._staged)
        self._asked += 1
        return self.simulation.answer(stimulus)

    def resume_after(self, stimuli: Sequence[Stimulus]) -> None:
        """Answer those of the session's stimuli that have not been asked for yet, and forget the answers.

        Args:
            stimuli: all of them since the session's beginning.
        """
        for stimulus in stimuli[self._asked :]:
            self._asked += 1
            with suppress(DeviceError):  # it refused then, too
                self.simulation.answer(stimulus)

    def stop(self) -> None:
        """Disarm."""
        self._staged = False

    def unstage(self) -> None:
        """Disarm."""
        self._staged = False


class SimulatedPerson:
    """A simulation that measures the MEPs of a simulated person.

    Args:
        respond: answers a commanded ISI [ms] with the realised ISI and the MEP.
        reference: the event that ISIs count from.
        name: what the log calls the device.
        hit_delay_ms: mean and SD of the hit delay that the device states [ms].
        conditioning: what it delivers first.
    """

    def __init__(
        self,
        respond: Respond,
        reference: Reference,
        name: str = "simulated person",
        hit_delay_ms: tuple[float, float] | None = None,
        conditioning: Conditioning = "tap",
    ) -> None:
        self.info = DeviceInfo(
            name, reference, simulated=True, hit_delay_ms=hit_delay_ms, tap_alone=True, conditioning=conditioning
        )
        self._respond = respond

    def answer(self, stimulus: Stimulus) -> Measurement:
        """The person's answer to the next pair of stimuli; a tap alone evokes nothing."""
        if stimulus.tap_alone:
            return Measurement(0.0, None)
        outcome = self._respond(stimulus.isi_ms)
        return Measurement(outcome.mep_mv, outcome.isi_ms, outcome.isi_sd_ms)


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
        """Fire nothing."""
        require_staged(self._info.name, staged=self._staged)
        return Measurement(0.0, stimulus.isi_ms)

    def stop(self) -> None:
        """Refuse what comes until the next `stage`."""
        self._staged = False

    unstage = stop
