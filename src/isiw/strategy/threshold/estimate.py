"""The intensities that a search for the motor threshold may ask, and the estimate of the threshold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Final

import numpy as np

from isiw.checks import Checked, number
from isiw.errors import InvalidValueError, LimitExceededError
from isiw.types import FloatArray

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
