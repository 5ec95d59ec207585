"""A device that asks a function what came of a stimulus: simulated people, or anything else that can answer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeAlias

from isiw.devices.protocol import DeviceInfo, require_staged
from isiw.trials import Measurement, Stimulus
from isiw.types import Reference

__all__ = ["Outcome", "Respond", "SimulatedDevice", "SimulatedPerson"]


class Outcome(Protocol):
    """What a simulated person answers."""

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


class SimulatedPerson:
    """A person with a memory (drift, start-up), who can be brought to where a broken session left them.

    Args:
        respond: answers one stimulus after the other.
    """

    def __init__(self, respond: Respond) -> None:
        self._respond = respond
        self._answered = 0

    def answer(self, isi_ms: float | None) -> Outcome:
        """Answer the next stimulus [ms]."""
        self._answered += 1
        return self._respond(isi_ms)

    def resume_after(self, stimuli: Sequence[Stimulus]) -> None:
        """Answer those of the session's stimuli that have not been answered yet, and forget the answers."""
        for stimulus in stimuli[self._answered :]:
            self.answer(stimulus.isi_ms)


class SimulatedDevice:
    """Measures the MEPs of a simulated person; delivers nothing to anybody.

    Args:
        respond: answers a commanded ISI [ms] with the realised ISI and the MEP.
        reference: the event that ISIs count from.
        name: what the log calls it.
    """

    def __init__(self, respond: Respond, reference: Reference, name: str = "simulated person") -> None:
        self._person = SimulatedPerson(respond)
        self._info = DeviceInfo(name=name, reference=reference, simulated=True)
        self._staged = False

    def describe(self) -> DeviceInfo:
        """What the device is."""
        return self._info

    def stage(self) -> None:
        """Arm."""
        self._staged = True

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Measurement:  # noqa: ARG002 - answers at once
        """The person's answer to one pair of stimuli."""
        require_staged(self._info.name, staged=self._staged)
        outcome = self._person.answer(stimulus.isi_ms)
        return Measurement(outcome.mep_mv, outcome.isi_ms, outcome.isi_sd_ms)

    def resume_after(self, stimuli: Sequence[Stimulus]) -> None:
        """Bring the person to where they were after these stimuli."""
        self._person.resume_after(stimuli)

    def stop(self) -> None:
        """Disarm."""
        self._staged = False

    def unstage(self) -> None:
        """Disarm."""
        self._staged = False
