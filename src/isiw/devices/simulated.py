"""A device that stimulates nobody, and what it stands for: a simulated person, recorded trials, or whatever answers."""

from __future__ import annotations

import dataclasses
import os
import zlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeAlias

import numpy as np

from isiw.devices.info import DeviceInfo
from isiw.devices.protocol import Answer, Device, Readiness, readiness_of, require_staged
from isiw.devices.robot.waveforms import scale_of_mep
from isiw.errors import DeviceError, InvalidValueError
from isiw.lazy import pd
from isiw.signals.spans import MEP_WINDOW_MS
from isiw.subjects.subject import Response
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import MOST_ISI_SD_MS, Stimulus, Trial, TrialTable
from isiw.types import BoolArray, Conditioning, FloatArray, Reference

Respond: TypeAlias = Callable[..., Response | Measurement]
"""Answers a commanded ISI [ms]; None is TMS alone. One that sets intensities takes `intensity_pct_rmt` as well."""


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
        sets_intensity: whether `respond` takes `intensity_pct_rmt`.

    Raises:
        InvalidValueError: an unknown reference or conditioning, a hit delay that is no pair of positive numbers, or a
            name that is no text.
    """

    def __init__(
        self,
        respond: Respond,
        reference: Reference,
        name: str = "simulated person",
        hit_delay_ms: tuple[float, float] | None = None,
        conditioning: Conditioning = "tap",
        *,
        sets_intensity: bool = False,
    ) -> None:
        said: dict[str, Any] = {"hit_delay_ms": hit_delay_ms, "conditioning": conditioning}
        self.info = DeviceInfo(name, reference, simulated=True, tap_alone=True, sets_intensity=sets_intensity, **said)
        self._respond = respond

    def answer(self, stimulus: Stimulus) -> Measurement:
        """The person's answer to the next pair of stimuli; a tap alone evokes nothing."""
        if stimulus.tap_alone:
            return Measurement(0.0, None)
        own = {} if stimulus.intensity_pct_rmt is None else {"intensity_pct_rmt": stimulus.intensity_pct_rmt}
        outcome = self._respond(stimulus.isi_ms, **own)
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

    Trials at another intensity than the usual one answer only a stimulus of that intensity.

    A session that asks what was asked before gets the same answers; another one gets the nearest there are, at the ISIs
    at which they were really recorded. These may be far from what is asked, so another strategy needs a space with a
    `tolerance_ms` wider than its range: beyond it a session takes the recorded trial for a mistrial and learns nothing
    from it. Its limits end the session when all recorded pairs of stimuli are used up:

        record = isiw.read_session("session.mcap")
        space = dataclasses.replace(record.header.space, tolerance_ms=1000.0)
        pairs = sum(t.isi_ms is not None and t.intensity_pct_rmt is None for t in record.table.told)
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
        alone, pct_rmt = asked_ms is None, stimulus.intensity_pct_rmt
        fitting = [t for t in self._left if (t.isi_ms is None) == alone and t.intensity_pct_rmt == pct_rmt]
        if not fitting:
            raise DeviceError(
                "no recorded trial is left to answer with",
                got="the usual intensity" if pct_rmt is None else f"{pct_rmt:g} % RMT",
                remedy="Give the limits as many max_pulses as there are recorded pairs at that intensity, or replay a "
                "longer recording. Where trials were mistrials for their ISI, give the space a tolerance_ms wider than "
                "its range.",
            )
        trial = min(fitting, key=lambda candidate: abs((candidate.wanted_isi_ms or 0.0) - (asked_ms or 0.0)))
        self._left.remove(trial)
        values = {field.name: getattr(trial, field.name) for field in dataclasses.fields(Measurement)}
        return Measurement(**values | {"mep_mv": trial.mep_mv or 0.0})


PATTERN = "uef_*_ECR_epochs_uV_3kHz.csv.gz"
QUIET_MV = 0.02  # recorded floors reach 20 µV peak-to-peak; the smallest recorded MEP here has 80 µV
CLEAR_MV = 0.2  # a scaled-down MEP brings its own noise along, so only large ones are templates
BACKGROUND_UNTIL_MS = -2.0  # the artefact begins here
ONSET_MS = (10.0, 14.0)  # forearm MEPs begin 17.5 ms after the pulse: the template is faded in before


@dataclass(frozen=True, eq=False)
class Recordings:
    """Recorded sweeps without an MEP, (n, w), recorded MEPs alone, (m, w), and times from the magnetic pulse, (w,)."""

    time_ms: FloatArray
    quiet_mv: FloatArray
    mep_mv: FloatArray  # offset taken out, and faded in before the onset

    def __post_init__(self) -> None:
        if not len(self.quiet_mv) or not len(self.mep_mv):
            raise InvalidValueError(
                "the recordings hold no sweep without an MEP, or none with a clear one",
                got=(len(self.quiet_mv), len(self.mep_mv)),
            )

    @property
    def rate_hz(self) -> float:
        """Sampling rate [Hz]; the recorded times are rounded, their span is not."""
        return 1e3 * (len(self.time_ms) - 1) / float(self.time_ms[-1] - self.time_ms[0])

    @property
    def in_mep_window(self) -> BoolArray:
        """Which samples lie 15–35 ms after the pulse, shape (w,)."""
        return (self.time_ms >= MEP_WINDOW_MS[0]) & (self.time_ms <= MEP_WINDOW_MS[1])

    def sweep_mv(self, mep_mv: float, rng: np.random.Generator) -> FloatArray:
        """A recorded sweep with an MEP with which the *sum* has this amplitude [mV], (w,); none if the floor has it."""
        quiet = self.quiet_mv[rng.integers(len(self.quiet_mv))]
        template = self.mep_mv[rng.integers(len(self.mep_mv))]
        floor, unit = quiet[self.in_mep_window], template[self.in_mep_window]
        return np.asarray(quiet + scale_of_mep(floor, unit, mep_mv) * template, dtype=np.float64)


def load_recordings(folder: str | os.PathLike[str]) -> Recordings:
    """Read the recorded forearm sweeps."""
    files = sorted(Path(folder).glob(PATTERN))
    if not files:
        raise DeviceError(
            "the recorded sweeps were not found",
            got=str(folder),
            expected=f"a folder with {PATTERN}",
            remedy="Give their folder with --data, or use --subject simulated.",
        )
    frames = [_read_sweeps(file) for file in files]
    time_ms = frames[0].columns.to_numpy()
    if any(list(frame.columns) != list(frames[0].columns) for frame in frames):
        raise DeviceError("the recorded files do not share their times", got=[file.name for file in files])
    sweeps_mv = np.concatenate([frame.to_numpy() for frame in frames]) / 1e3
    in_window = (time_ms >= MEP_WINDOW_MS[0]) & (time_ms <= MEP_WINDOW_MS[1])
    amplitude = np.ptp(sweeps_mv[:, in_window], axis=1)
    offset = sweeps_mv[:, time_ms < BACKGROUND_UNTIL_MS].mean(axis=1, keepdims=True)
    fade_in = np.clip((time_ms - ONSET_MS[0]) / (ONSET_MS[1] - ONSET_MS[0]), 0.0, 1.0)
    clear = amplitude > CLEAR_MV
    return Recordings(time_ms, sweeps_mv[amplitude < QUIET_MV], (sweeps_mv[clear] - offset[clear]) * fade_in)


def _read_sweeps(file: Path) -> pd.DataFrame:
    try:
        frame = pd.read_csv(file, index_col="trial").astype(np.float64)
        return frame.set_axis(frame.columns.astype(np.float64), axis=1)
    except (OSError, EOFError, ValueError, zlib.error) as error:
        raise DeviceError(f"a recorded file cannot be read: {error}", got=str(file), remedy="Copy it again.") from error


class RecordedPerson:
    """A simulation of a person whose amplitudes are put into recorded EMG [UEF2023]: semi-synthetic.

    A recorded MEP is scaled so that its sum with a sweep without one has the person's amplitude from 15 to 35 ms.

    Args:
        respond: answers a commanded ISI [ms] with the realised ISI and the MEP.
        reference: the event that ISIs count from.
        recordings: the recorded sweeps.
        seed: seed of the choice of sweeps; the choice of a trial depends on the seed and the trial's number alone.
        hit_delay_ms: mean and SD of the hit delay that the device states [ms].
        conditioning: what it delivers first.
    """

    def __init__(
        self,
        respond: Respond,
        reference: Reference,
        recordings: Recordings,
        seed: int = 0,
        hit_delay_ms: tuple[float, float] | None = None,
        conditioning: Conditioning = "tap",
    ) -> None:
        self.info = DeviceInfo(
            "simulated person in recorded EMG (semi-synthetic)",
            reference,
            simulated=True,
            channels={"emg": "mV"},
            hit_delay_ms=hit_delay_ms,
            tap_alone=True,
            conditioning=conditioning,
        )
        self._respond, self._recordings, self._seed = respond, recordings, seed

    def answer(self, stimulus: Stimulus) -> Sweep:
        """The sweep that follows the next pair of stimuli; its clock is zero at the pulse, or at a tap alone."""
        recordings, rng = self._recordings, np.random.default_rng([self._seed, stimulus.trial])
        alone = Measurement(0.0, 0.0) if stimulus.tap_alone else None
        outcome = alone or self._respond(stimulus.isi_ms)
        emg_mv = recordings.sweep_mv(outcome.mep_mv, rng)
        first_ms = None if outcome.isi_ms is None else 0.0 - outcome.isi_ms
        return Sweep(
            {"emg": Channel(emg_mv, recordings.rate_hz, "mV", t0_ms=float(recordings.time_ms[0]))},
            t_valve_ms=first_ms if self.info.reference == "valve" else None,
            t_tms_ms=None if alone else 0.0,
            t_hit_ms=first_ms if self.info.reference == "impact" else None,
            isi_sd_ms=outcome.isi_sd_ms,
        )
