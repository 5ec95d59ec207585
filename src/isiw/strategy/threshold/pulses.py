"""Single pulses of TMS by intensity: which may be asked, and what they say about the threshold [Rossini2015]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final, Protocol

import numpy as np

from isiw.checks import Amplitude, Checked, Flag, number
from isiw.decision import StopDecision, StopKind
from isiw.errors import InvalidValueError
from isiw.strategy.threshold.estimate import IntensityRange, ThresholdEstimate
from isiw.trials import RESPONSE_MV

ENOUGH_AT_THE_END: Final = 6
NEAR_THE_END_PCT_MSO: Final = 3.0
"""After so many pulses so near to the end of the range, none of which changed anything, the range is wrong."""

LEAST_RATIO: Final = 1.5
"""Answered pulses are larger than the others by more than this; in 2 of 4,000 simulated searches they are not."""


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
