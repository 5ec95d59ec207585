"""A device that stimulates nobody, and what it stands for: a simulated person, recorded trials, or whatever answers."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Protocol, TypeAlias

from isiw.devices.protocol import Answer, Device, DeviceInfo, Readiness, readiness_of, require_staged
from isiw.errors import DeviceError
from isiw.trials import MOST_ISI_SD_MS, Measurement, Stimulus, Trial, TrialTable
from isiw.types import Conditioning, Reference


class SimulatedOutcome(Protocol):
    """The outcome of a simulated stimulus."""

    @property
    def isi_ms(self) -> float | None:
        """The ISI as reported [ms]; None for TMS alone."""

    @property
    def mep_mv(self) -> float:
        """Peak-to-peak amplitude of the MEP [mV]."""

    @property
    def isi_sd_ms(self) -> float:
        """SD of the realised ISI about the reported one [ms]."""


Respond: TypeAlias = Callable[[float | None], SimulatedOutcome]
"""Answers a commanded ISI [ms]; None is TMS alone."""


class Simulation(Protocol):
    """The source of the answers of a simulated device: one stimulus after the other, which it may remember."""

    @property
    def info(self) -> DeviceInfo:
        """The description of the device; it is simulated."""

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
        """The device's description."""
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
        """Answer those of the session's stimuli that have not been delivered yet, and forget the answers."""
        for stimulus in stimuli[self._asked :]:
            self._asked += 1
            with suppress(DeviceError):  # it refused then, too
                self.simulation.answer(stimulus)

    def stop(self) -> None:
        """Disarm."""
        self._staged = False

    unstage = stop


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


class _NoResponse:
    """A simulation of somebody in whom no stimulus evokes anything."""

    def __init__(self, info: DeviceInfo) -> None:
        self.info = info

    def answer(self, stimulus: Stimulus) -> Measurement:
        return Measurement(0.0, stimulus.isi_ms)


class DryRun(SimulatedDevice):
    """A device that is never armed and never fires: every stimulus is answered with an MEP of 0.

    Strategy, limits, readiness, pauses and log can be tried with the rig connected. It counts as simulated; give the
    session a `MonotonicClock` to rehearse its pace, too.

    Args:
        device: the real one; only `describe` and, if it has it, `readiness` are called.
    """

    def __init__(self, device: Device) -> None:
        self._device, info = device, device.describe()
        called = f"dry run of {info.name}"
        super().__init__(_NoResponse(dataclasses.replace(info, name=called, simulated=True, channels={})))

    def readiness(self) -> Readiness:
        """The state of the real device."""
        return readiness_of(self._device)


class RecordedTrials:
    """A simulation that answers each stimulus with the recorded trial of the nearest ISI, each trial once.

    A session that asks what was asked before gets the same answers; another one gets the nearest there are, at the ISIs
    at which they were really recorded. These may be far from what is asked, so another strategy needs a space with a
    `tolerance_ms` wider than its range: beyond it a session takes the recorded trial for a mistrial and learns nothing
    from it. Its limits end the session when all recorded pairs of stimuli are used up:

        record = isiw.read_session("session.mcap")
        space = dataclasses.replace(record.header.space, tolerance_ms=1000.0)
        pairs = sum(trial.isi_ms is not None for trial in record.table.told)
        device = isiw.SimulatedDevice(isiw.RecordedTrials(record.table, space.reference))
        limits = isiw.Limits.of_space(space, max_pulses=pairs)
        isiw.Session(device, isiw.make_strategy(space=space), log="again.mcap", limits=limits).run()

    Args:
        table: the recorded trials; only those that a strategy may learn from are used, and whose ISIs are known.
        reference: the event that their ISIs count from.
    """

    def __init__(self, table: TrialTable, reference: Reference) -> None:
        self.info = DeviceInfo(name="replay of recorded trials", reference=reference, simulated=True)
        self._left: list[Trial] = [trial for trial in table.told if trial.isi_sd_ms <= MOST_ISI_SD_MS]

    def answer(self, stimulus: Stimulus) -> Measurement:
        """The recorded answer nearest to the next pair of stimuli; a DeviceError if no trial is left."""
        asked_ms = stimulus.isi_ms
        fitting = [trial for trial in self._left if (trial.isi_ms is None) == (asked_ms is None)]
        if not fitting:
            raise DeviceError(
                "no recorded trial is left to answer with",
                remedy="Give the limits as many max_pulses as there are recorded pairs, or replay a longer recording. "
                "Where trials were mistrials for their ISI, give the space a tolerance_ms wider than its range.",
            )
        trial = min(fitting, key=lambda candidate: abs((candidate.wanted_isi_ms or 0.0) - (asked_ms or 0.0)))
        self._left.remove(trial)
        return Measurement(
            trial.mep_mv or 0.0,
            trial.isi_ms,
            trial.isi_sd_ms,
            trial.background_rms_uv,
            trial.t_valve_ms,
            trial.t_hit_ms,
            trial.t_tms_ms,
        )
