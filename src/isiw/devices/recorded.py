"""Simulated people in recorded EMG [UEF2023]: semi-synthetic sweeps, for tests of the whole chain.

A recorded MEP is scaled so that its sum with a sweep without one has the person's amplitude from 15 to 35 ms.
"""

from __future__ import annotations

import os
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from isiw.devices.protocol import DeviceInfo
from isiw.devices.robot.waveforms import scale_of_mep
from isiw.devices.simulated import Respond
from isiw.errors import DeviceError, InvalidValueError
from isiw.lazy import pd
from isiw.signals.mep import MEP_WINDOW_MS
from isiw.trials import Channel, Stimulus, Sweep
from isiw.types import BoolArray, Conditioning, FloatArray, Reference

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
    """A simulation of a person whose amplitudes are put into recorded EMG: semi-synthetic.

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
        rng = np.random.default_rng([self._seed, stimulus.trial])
        if stimulus.tap_alone:
            by_valve = self.info.reference == "valve"
            return Sweep(
                {"emg": self._emg(0.0, rng)}, t_valve_ms=0.0 if by_valve else None, t_hit_ms=None if by_valve else 0.0
            )
        outcome = self._respond(stimulus.isi_ms)
        emg = self._emg(outcome.mep_mv, rng)
        first_ms = None if outcome.isi_ms is None else -outcome.isi_ms
        return Sweep(
            {"emg": emg},
            t_valve_ms=first_ms if self.info.reference == "valve" else None,
            t_tms_ms=0.0,
            t_hit_ms=first_ms if self.info.reference == "impact" else None,
            isi_sd_ms=outcome.isi_sd_ms,
        )

    def _emg(self, mep_mv: float, rng: np.random.Generator) -> Channel:
        emg_mv = self._recordings.sweep_mv(mep_mv, rng)
        return Channel(emg_mv, self._recordings.rate_hz, "mV", t0_ms=float(self._recordings.time_ms[0]))
