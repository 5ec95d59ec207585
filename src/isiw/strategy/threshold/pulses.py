"""Single pulses of TMS by intensity: which may be asked, and what they say about the threshold [Rossini2015]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Final, Protocol

import numpy as np

from isiw.checks import Amplitude, Checked, Flag, number
from isiw.errors import InvalidValueError, LimitExceededError
from isiw.strategy.decisions import StopDecision, StopKind
from isiw.trials import RESPONSE_MV
from isiw.types import FloatArray

ENOUGH_AT_THE_END: Final = 6
NEAR_THE_END_PCT_MSO: Final = 3.0
"""After so many pulses so near to the end of the range, none of which changed anything, the range is wrong."""

LEAST_RATIO: Final = 1.5
"""Answered pulses are larger than the others by more than this; in 2 of 4,000 simulated searches they are not."""

_GRID_TOLERANCE: Final = 1e-6


@dataclass(frozen=True)
class IntensityRange(Checked):
    """The intensities that may be asked: a grid from the lowest to the highest, both included; nothing exceeds it.

    Args:
        low_pct_mso: the lowest [% of the maximum stimulator output].
        high_pct_mso: the highest [% MSO].
        step_pct_mso: the distance between two [% MSO]; the range must hold a whole number of steps.

    Raises:
        InvalidValueError: bounds outside 1–100 % or that do not ascend, or a step that does not fit.
    """

    low_pct_mso: Annotated[float, partial(number, least=1, most=100)]
    high_pct_mso: Annotated[float, partial(number, least=1, most=100)]
    step_pct_mso: Annotated[float, partial(number, least=0.1)] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        steps = (self.high_pct_mso - self.low_pct_mso) / self.step_pct_mso
        if steps < 1 or abs(steps - round(steps)) > _GRID_TOLERANCE:
            raise InvalidValueError(
                "the range of intensities is not a whole number of steps",
                got=(self.low_pct_mso, self.high_pct_mso, self.step_pct_mso),
                expected="low_pct_mso < high_pct_mso, apart by whole steps",
            )

    def __str__(self) -> str:
        return f"{self.low_pct_mso:g}–{self.high_pct_mso:g} % MSO, every {self.step_pct_mso:g} %"

    @property
    def grid_pct_mso(self) -> FloatArray:
        """All intensities that may be asked [% MSO], ascending."""
        return np.linspace(self.low_pct_mso, self.high_pct_mso, 1 + self._steps(self.high_pct_mso))

    def snap(self, intensity_pct_mso: float) -> float:
        """The nearest intensity on the grid [% MSO]."""
        inside = min(max(number("an intensity [% MSO]", intensity_pct_mso), self.low_pct_mso), self.high_pct_mso)
        return float(self.grid_pct_mso[self._steps(inside)])

    def beyond(self, threshold_pct_mso: float) -> str | None:
        """On which side of the range a threshold [% MSO] is, in words; None if it is within."""
        if threshold_pct_mso > self.high_pct_mso:
            return f"above the highest intensity, {self.high_pct_mso:g} % MSO"
        if threshold_pct_mso < self.low_pct_mso:
            return f"below the lowest intensity, {self.low_pct_mso:g} % MSO"
        return None

    def _steps(self, intensity_pct_mso: float) -> int:
        return round((intensity_pct_mso - self.low_pct_mso) / self.step_pct_mso)

    def require(self, intensity_pct_mso: float) -> None:
        """Raise if an intensity must not be delivered.

        Raises:
            InvalidValueError: it is not a finite number.
            LimitExceededError: it is beyond the range, or off the grid.
        """
        intensity_pct_mso = number("an intensity [% MSO]", intensity_pct_mso)
        within = self.low_pct_mso <= intensity_pct_mso <= self.high_pct_mso
        if not (within and abs(self.snap(intensity_pct_mso) - intensity_pct_mso) <= _GRID_TOLERANCE):
            raise LimitExceededError(
                "the intensity is beyond the limits, or not on their grid",
                got=intensity_pct_mso,
                expected=str(self),
                remedy="Choose an intensity within the range.",
            )


@dataclass(frozen=True)
class Pulse(Checked):
    """One pulse of TMS and what came of it.

    Args:
        intensity_pct_mso: its intensity [% MSO].
        mep_mv: peak-to-peak amplitude of the MEP [mV]; 0 is below the detection limit. None if it was only seen
            whether there was a response.
        response: whether there was a response; None if the amplitude says it.
        place_mm: the coil's place from the middle of the searched area [mm], if the hot spot is sought.

    Raises:
        InvalidValueError: not exactly one of the two, or a value that cannot be.
    """

    intensity_pct_mso: Annotated[float, partial(number, above=0, most=100)]
    mep_mv: Amplitude | None = None
    response: Flag | None = None
    place_mm: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.mep_mv is None) == (self.response is None):
            raise InvalidValueError(
                "a pulse has either an amplitude or a response that was seen or not",
                got=(self.mep_mv, self.response),
                expected="mep_mv in mV, or response True or False",
            )

    @property
    def responded(self) -> bool:
        """True if there was a response: an MEP above 50 µV."""
        return bool(self.response) if self.mep_mv is None else self.mep_mv > RESPONSE_MV


def place_text(place_mm: tuple[float, float]) -> str:
    """A place of the coil, in words."""
    return f"{round(place_mm[0]):+d} mm forward, {round(place_mm[1]):+d} mm to the right of the middle"


@dataclass(frozen=True)
class ThresholdEstimate:
    """The estimate of the resting motor threshold.

    Args:
        threshold_pct_mso: the threshold [% MSO]; None if there is no number to report, and `reason` says why.
        low_pct_mso: lower end of its 90 % interval; None if the method has none.
        high_pct_mso: upper end of its 90 % interval.
        sd_pct_mso: SD of the posterior; None if the method has none.
        reason: why there is no number; empty if there is one.
        hot_spot_mm: in a search for the hot spot, its place from the middle of the searched area [mm].
        hot_spot_sd_mm: root of the mean squared distance from there [mm].
    """

    threshold_pct_mso: float | None
    low_pct_mso: float | None = None
    high_pct_mso: float | None = None
    sd_pct_mso: float | None = None
    reason: str = ""
    hot_spot_mm: tuple[float, float] | None = None
    hot_spot_sd_mm: float | None = None

    def __str__(self) -> str:
        if self.hot_spot_mm is not None:
            return f"Hot spot: {place_text(self.hot_spot_mm)}, within about {self.hot_spot_sd_mm or 0.0:.0f} mm."
        if self.threshold_pct_mso is None:
            return f"No threshold can be stated. {self.reason}"
        said = f"Resting motor threshold: {self.threshold_pct_mso:.1f} % MSO"
        if self.low_pct_mso is None or self.high_pct_mso is None:
            return f"{said}."
        return f"{said} (90 % interval {self.low_pct_mso:.1f}–{self.high_pct_mso:.1f})."

    def within(self, space: IntensityRange) -> ThresholdEstimate:
        """The same, without its number if that is beyond the range of intensities."""
        side = None if self.threshold_pct_mso is None else space.beyond(self.threshold_pct_mso)
        return replace(self, threshold_pct_mso=None, reason=f"It is probably {side}.") if side else self


class ThresholdMethod(Protocol):
    """A way to a threshold: settings that answer from the pulses so far, and remember nothing themselves.

    One that stops after so many pulses, whatever it knows then, says how many by an attribute `budget`.
    """

    def ask(self, pulses: Sequence[Pulse], space: IntensityRange) -> float:
        """The next intensity [% MSO], on the grid.

        Args:
            pulses: the pulses so far, in order.
            space: the intensities that may be asked.
        """

    def estimate(self, pulses: Sequence[Pulse], space: IntensityRange) -> ThresholdEstimate:
        """The estimate now; only called if there were responses and pulses without one.

        Args:
            pulses: the pulses so far, in order.
            space: the intensities that may be asked.
        """

    def decision(self, pulses: Sequence[Pulse], space: IntensityRange) -> StopDecision:
        """The decision to stop or not, with its reason.

        Args:
            pulses: the pulses so far, in order.
            space: the intensities that may be asked.
        """


def one_sided(pulses: Sequence[Pulse], space: IntensityRange) -> StopDecision | None:
    """The warning that responses all alike give no number, and whether the range can change that; else None."""
    kinds = {pulse.responded for pulse in pulses}
    if len(kinds) == 2:
        return None
    if not kinds:
        return StopKind.THRESHOLD.go_on("No pulse has an outcome yet.")
    answered = kinds == {True}
    end = space.low_pct_mso if answered else space.high_pct_mso
    at_end = sum(abs(pulse.intensity_pct_mso - end) <= NEAR_THE_END_PCT_MSO for pulse in pulses)
    if answered:
        seen = f"Every pulse evoked an MEP, down to {min(pulse.intensity_pct_mso for pulse in pulses):g} % MSO."
        advice = (
            f"Begin a new search at a lower intensity (this range begins at {end:g} % MSO). Or is the muscle not at "
            "rest, or the EMG not quiet?"
        )
    else:
        seen = f"No pulse evoked an MEP, up to {max(pulse.intensity_pct_mso for pulse in pulses):g} % MSO."
        advice = (
            "Is the coil on the hot spot, and the amplifier on? If so, and if it is safe for this person, begin a new "
            f"search with a higher maximum (this range ends at {end:g} % MSO)."
        )
    over = at_end >= ENOUGH_AT_THE_END
    return StopDecision(over, f"{seen} {advice}" if over else seen, StopKind.THRESHOLD)


def not_growing(pulses: Sequence[Pulse]) -> str | None:
    """That no pulse was answered at a higher intensity than one that was not, in words; None if one was."""
    answered = max(pulse.intensity_pct_mso for pulse in pulses if pulse.responded)
    missed = min(pulse.intensity_pct_mso for pulse in pulses if not pulse.responded)
    if answered > missed:
        return None
    if answered == missed:
        return f"At {missed:g} % MSO some pulses evoked an MEP and some did not, and none above it did."
    return f"Pulses evoked MEPs up to {answered:g} % MSO, but not from {missed:g} % MSO on."


def hardly_larger(pulses: Sequence[Pulse]) -> str | None:
    """That the amplitudes of answered pulses are about those of the others, in words; None if they are larger."""
    answered_mv = [pulse.mep_mv for pulse in pulses if pulse.responded and pulse.mep_mv is not None]
    missed_mv = [pulse.mep_mv for pulse in pulses if not pulse.responded and pulse.mep_mv is not None]
    if not (answered_mv and missed_mv):
        return None
    answered, missed = float(np.median(answered_mv)), float(np.median(missed_mv))
    if answered > LEAST_RATIO * missed:
        return None
    return (
        f"The amplitudes that count as MEPs (median {1e3 * answered:.0f} µV) are only a little larger than the others "
        f"(median {1e3 * missed:.0f} µV)."
    )
