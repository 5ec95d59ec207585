"""Limits that no strategy, session or mistake can exceed, as they are stated and logged."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Self

from isiw.checks import Checked, Count, NonNegative, Number, Positive, fields_of
from isiw.design import DesignSpace, require_space
from isiw.errors import InvalidValueError

USUAL_ITI_S = 5.0
"""Between two stimuli that isiw delivers, if nobody states another interval [s]."""


@dataclass(frozen=True, kw_only=True)
class PulseLimits(Checked):
    """Limits on the pulses of a session, whatever their ISIs.

    Args:
        min_iti_s: shortest time between two deliveries [s]; by default 5 s, and none in a loop of your own in Python.
        max_pulses: largest number of deliveries in a session, failed ones included.
        max_block_pulses: most deliveries in a row without a rest; None if none is needed.
        rest_s: a pause of this length is a rest [s].
        max_period_pulses: most deliveries in any period; None if they are not limited.
        period_s: length of that period [s].
        max_coil_c: highest temperature of the coil at which to deliver [°C]; the device must report it.
        intensity_pct_mso: the only intensity at which to deliver [% of the maximum stimulator output]; the device must
            report it. Where None, one that is reported has to be the visit's, or else the first one.
        max_consecutive_mistrials: a session pauses after so many rejected trials, or of a faulty rig, in a row.
        max_intensity_pct_rmt: the highest intensity that a device may be asked to set [% RMT]; None if it may be asked
            to set none. Where one is stated, a reported intensity may change from pulse to pulse, and where the visit
            states the usual one in both units none above it is delivered.

    Raises:
        InvalidValueError: an invalid number, or both an only and a highest intensity.
    """

    min_iti_s: NonNegative | None = None
    max_pulses: Count = 200
    max_block_pulses: Count | None = None
    rest_s: Positive = 120.0
    max_period_pulses: Count | None = None
    period_s: Positive = 3600.0
    max_coil_c: Number | None = None
    intensity_pct_mso: NonNegative | None = None
    max_consecutive_mistrials: Count = 3
    max_intensity_pct_rmt: Positive | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.intensity_pct_mso is not None and self.max_intensity_pct_rmt is not None:
            raise InvalidValueError(
                "the limits have both the only intensity and the highest one",
                got=f"intensity_pct_mso = {self.intensity_pct_mso:g}, "
                f"max_intensity_pct_rmt = {self.max_intensity_pct_rmt:g}",
                remedy="Leave out max_intensity_pct_rmt, or, in a session of several intensities, intensity_pct_mso.",
            )

    @property
    def iti_s(self) -> float:
        """The interval that holds if isiw delivers [s]."""
        return USUAL_ITI_S if self.min_iti_s is None else self.min_iti_s

    @property
    def looks_back(self) -> bool:
        """True if it matters when earlier stimuli came, before the last interval."""
        return self.max_block_pulses is not None or self.max_period_pulses is not None

    def stated(self, iti_s: float) -> Self:
        """The same with this interval [s], unless another one is stated."""
        return replace(self, min_iti_s=iti_s) if self.min_iti_s is None else self

    def within(self, space: DesignSpace) -> Limits:
        """The same, with exactly the ISIs of a design space."""
        require_space(space)
        own, step_ms = fields_of(PulseLimits, self), None if space.isis_ms else space.step_ms
        return Limits(space.low_ms, space.high_ms, step_ms=step_ms, isis_ms=space.isis_ms, **own)


@dataclass(frozen=True)
class Limits(PulseLimits):
    """Limits on what may be delivered: the ISIs, and what `PulseLimits` has.

    Args:
        low_ms: shortest ISI on the device's reference [ms].
        high_ms: longest ISI [ms].
        step_ms: ISIs are whole multiples of it above the shortest [ms]; None if any ISI of the range is allowed.
        isis_ms: the only ISIs that are allowed [ms]; by default all of the range, or of its grid.

    Raises:
        InvalidValueError: ISIs that do not ascend, or as of `PulseLimits`.
    """

    low_ms: Number
    high_ms: Number
    step_ms: Positive | None = field(default=None, kw_only=True)
    isis_ms: tuple[float, ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.low_ms > self.high_ms:
            raise InvalidValueError("the limits of the ISI must ascend", got=(self.low_ms, self.high_ms))

    @staticmethod
    def of_space(space: DesignSpace, **limits: Any) -> Limits:
        """Limits that allow exactly the ISIs of a design space.

        Args:
            space: the design space.
            **limits: fields of `PulseLimits`.

        Raises:
            InvalidValueError: no design space, or values that are not finite or limit nothing.
        """
        return PulseLimits(**limits).within(space)
