"""Limits that no strategy, session or mistake can exceed, and what they say about the next stimulus."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Self

from isiw.checks import Checked, Count, NonNegative, Number, Positive, fields_of
from isiw.design import DesignSpace, require_space
from isiw.devices.info import Readiness
from isiw.errors import InvalidValueError, LimitExceededError
from isiw.visit import interval_s

_GRID_TOLERANCE_MS = 1e-6
_SAME_PCT_MSO = 0.01  # what a conversion on the way may lose

USUAL_ITI_S = 5.0
"""Between two stimuli that isiw delivers, if nobody states another interval [s]."""

MOST_COIL_C = 60.0
"""No coil that touches a person may be as hot as that [°C]."""


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
            report it. Where None, one that is reported has to be the visit's, or else that at staging.
        max_consecutive_mistrials: a session pauses after so many rejected trials, or of a faulty rig, in a row.
        max_intensity_pct_rmt: the highest intensity that a device may be asked to set [% RMT]; None if it may be asked
            to set none. Where one is stated, a reported intensity may change from pulse to pulse.

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

    def require_effect(self) -> None:
        """Raise InvalidValueError if a limit limits nothing, or is probably in another unit.

        The interval alone may keep what a rest or a period asks for, or be in ms, and no coil be as hot as its limit.

        It is for limits that somebody states: those of earlier logs stay readable.
        """
        interval_s("Limits.min_iti_s", self.iti_s)
        if self.max_coil_c is not None and self.max_coil_c > MOST_COIL_C:
            raise InvalidValueError(
                "Limits.max_coil_c is hotter than a coil may be that touches a person, so it would have no effect",
                got=self.max_coil_c,
                expected=f"at most {MOST_COIL_C:g} °C",
                remedy="Is it in °F, or in tenths of a degree? Write it in °C, such as 40.",
            )
        if self.max_block_pulses is not None and self.rest_s <= self.iti_s:
            raise InvalidValueError(
                "the rest of the limits is no longer than the interval between two stimuli, so it would have no effect",
                got=f"rest_s {self.rest_s:g}, min_iti_s {self.iti_s:g}",
                expected=f"rest_s above {self.iti_s:g}",
                remedy="Set a longer rest_s [s], or leave out max_block_pulses and rest_s.",
            )
        # At the shortest interval n stimuli take so long that the next one comes when the first is n intervals old.
        if self.max_period_pulses is not None and self.period_s <= self.max_period_pulses * self.iti_s:
            raise InvalidValueError(
                "the period limit has no effect: at the shortest interval no more than max_period_pulses fit into it",
                got=f"period_s {self.period_s:g}, max_period_pulses {self.max_period_pulses}, min_iti_s {self.iti_s:g}",
                expected=f"period_s above {self.max_period_pulses * self.iti_s:g}",
                remedy="Set a longer period_s [s] or fewer max_period_pulses, or leave out both.",
            )

    def within(self, space: DesignSpace) -> Limits:
        """The same, with exactly the ISIs of a design space."""
        require_space(space)
        own, step_ms = fields_of(PulseLimits, self), None if space.isis_ms else space.step_ms
        return Limits(space.low_ms, space.high_ms, step_ms=step_ms, isis_ms=space.isis_ms, **own)

    def require_left(self, delivered: int) -> None:
        """Raise LimitExceededError if so many deliveries leave none."""
        if delivered >= self.max_pulses:
            raise LimitExceededError(
                f"the limit of {self.max_pulses} pulses is reached",
                remedy="This stimulus was not delivered. For more pulses raise max_pulses in the limits.",
            )

    def require_intensity(self, pct_rmt: float | None) -> None:
        """Raise LimitExceededError if an intensity to be set [% RMT] is beyond the limits; None sets none."""
        most = self.max_intensity_pct_rmt
        if pct_rmt is not None and not (most is not None and pct_rmt <= most):
            raise LimitExceededError(
                "the intensity is beyond the limits",
                got=f"{pct_rmt:g} % RMT",
                expected="no intensity to be set" if most is None else f"at most {most:g} % RMT",
                remedy="This stimulus was not delivered. Write max_intensity_pct_rmt under [limits] if your ethics "
                "approval allows it.",
            )

    def require_state(self, state: Readiness) -> None:
        """Raise LimitExceededError if the device reports a hot coil or another intensity, or lacks what is limited."""
        coil_c, intensity, own = state.coil_c, state.intensity_pct_mso, self.intensity_pct_mso
        if self.max_coil_c is not None and not (coil_c is not None and coil_c <= self.max_coil_c):
            way_on = "Let the device's readiness() report coil_c" if coil_c is None else "Let the coil cool"
            raise LimitExceededError(
                "the coil is too hot, or its temperature is not known",
                got="no temperature" if coil_c is None else f"{coil_c:g} °C",
                expected=f"at most {self.max_coil_c:g} °C",
                remedy=f"This stimulus was not delivered. {way_on}, then resume the session.",
            )
        if own is not None and (intensity is None or abs(intensity - own) > _SAME_PCT_MSO):
            reporting = "Let the device's readiness() report intensity_pct_mso"
            raise LimitExceededError(
                "the intensity is not the session's, or is not known",
                got="no intensity" if intensity is None else f"{intensity:g} % MSO",
                expected=f"{own:g} % MSO",
                remedy="This stimulus was not delivered. "
                f"{reporting if intensity is None else 'Set the intensity back'}, then resume the session.",
            )

    def earliest_s(self, times_s: Sequence[float], since_s: float) -> float:
        """When the next stimulus may come at the earliest [s].

        Args:
            times_s: when the earlier ones came [s], ascending, shape (n,).
            since_s: when the session began, or went on [s]; it waits a whole interval before its first stimulus.
        """
        if not times_s:
            return since_s + self.iti_s
        earliest = [max(since_s, times_s[-1]) + self.iti_s]
        if self.max_block_pulses is not None:
            last = times_s[-self.max_block_pulses :]
            is_block = all(after - before < self.rest_s for before, after in pairwise(last))
            if is_block and len(last) == self.max_block_pulses:
                earliest.append(times_s[-1] + self.rest_s)
        if self.max_period_pulses is not None and len(times_s) >= self.max_period_pulses:
            earliest.append(times_s[-self.max_period_pulses] + self.period_s)
        return max(earliest)


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

    def require_isi(self, isi_ms: float) -> None:
        """Raise LimitExceededError if an ISI is beyond the range, or off the grid."""
        if not self.low_ms <= isi_ms <= self.high_ms:
            raise LimitExceededError(
                "the ISI is beyond the limits",
                got=isi_ms,
                expected=f"{self.low_ms:g} to {self.high_ms:g} ms",
                remedy="This stimulus was not delivered. Narrow the design space to the limits; widen the limits only "
                "if your ethics approval allows it.",
            )
        if self.isis_ms and isi_ms not in self.isis_ms:
            raise LimitExceededError(
                "the ISI is not one of those that the limits list",
                got=isi_ms,
                expected=f"one of {', '.join(f'{one:g}' for one in self.isis_ms)} ms",
                remedy="This stimulus was not delivered. Use the same list in the design space and in the limits.",
            )
        if self.step_ms and math.fabs(math.remainder(isi_ms - self.low_ms, self.step_ms)) > _GRID_TOLERANCE_MS:
            raise LimitExceededError(
                "the ISI is not on the grid of the limits",
                got=isi_ms,
                expected=f"{self.low_ms:g} ms and steps of {self.step_ms:g} ms",
                remedy="This stimulus was not delivered. Use the same low_ms and step_ms in the design space and in "
                "the limits.",
            )
