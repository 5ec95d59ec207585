"""Whether amplitudes and ISIs can be true, and which slip they look like where they cannot: then they are refused.

The bounds leave room for every muscle: the EMG at rest has 2 to 30 µV peak-to-peak, the largest compound action
potentials some 25 mV. What is only odd is a doubt (`isiw.signals.doubts`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from isiw.checks import number
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.trials import MOST_ISI_SD_MS

__all__ = [
    "Slip",
    "before_impact",
    "implausible_amplitude",
    "implausible_scale",
    "off_by",
    "require_amplitude",
    "require_isi_sd",
    "require_plausible",
]

SMALLEST_MV = 2e-4
"""No EMG amplifier is so quiet: the noise of the electrodes alone has more."""

LARGEST_MV = 30.0

AT_REST_MV = 2e-3
"""EMG at rest has hardly ever less, since the noise of electrodes and amplifier alone has a few µV peak-to-peak; an MEP
of up to 2 mV that is told in V has less."""


class Slip(NamedTuple):
    """Why an amplitude cannot be true.

    Args:
        what: what is wrong, as a sentence without a full stop.
        remedy: the likely slip and what to do, in full sentences.
    """

    what: str
    remedy: str


_NO_MEP: Final = "the amplitude cannot be an MEP's"
_IN_VOLT: Final = "Is it in V? Multiply by 1000; an amplitude below the detection limit is 0."


def implausible_amplitude(mep_mv: float) -> Slip | None:
    """Why an amplitude cannot be an MEP's in mV, and the likely slip; None where it can, as 0 always can.

    Args:
        mep_mv: peak-to-peak amplitude [mV].
    """
    if 0 < mep_mv < SMALLEST_MV:
        return Slip(f"{_NO_MEP}: {mep_mv:.2g} mV is less than any amplifier's noise", _IN_VOLT)
    if mep_mv > LARGEST_MV:
        return Slip(f"{_NO_MEP}: {mep_mv:.4g} mV is more than any muscle gives", "Is it in µV? Divide by 1000.")
    return None


def implausible_scale(meps_mv: Sequence[float]) -> Slip | None:
    """Why amplitudes of single pulses to a muscle at rest cannot be in mV, and the likely slip; None where they can.

    Once one of them is as large as EMG at rest the scale is believed, and smaller ones may be a quiet sweep.

    Args:
        meps_mv: all amplitudes so far [mV], in order; 0, below the detection limit, says nothing about the scale.
    """
    largest_mv = max(meps_mv, default=0.0)
    if not 0 < largest_mv < AT_REST_MV:
        return None
    return Slip(f"{_NO_MEP}: {largest_mv:.2g} mV is less than EMG at rest has", _IN_VOLT)


def require_amplitude(mep_mv: float, slip: Slip | None = None) -> None:
    """Refuse an amplitude that no muscle gives.

    Args:
        mep_mv: peak-to-peak amplitude [mV].
        slip: what else is known to be wrong with it.

    Raises:
        InvalidValueError: it cannot be an MEP's in mV.
    """
    slip = implausible_amplitude(mep_mv) or slip
    if slip is not None:
        raise InvalidValueError(slip.what, got=mep_mv, remedy=slip.remedy)


def off_by(isi_ms: float, asked_ms: float, space: DesignSpace) -> bool:
    """Whether an ISI [ms] is farther than the space's tolerance from the one that was asked [ms].

    Args:
        isi_ms: the realised ISI.
        asked_ms: the one that was asked.
        space: the design space.
    """
    return abs(isi_ms - asked_ms) > space.tolerance_ms


def require_plausible(isi_ms: float | None, mep_mv: float | None, asked_ms: float | None, space: DesignSpace) -> None:
    """Refuse what cannot be true of one trial, or is a mistrial.

    Args:
        isi_ms: the realised ISI [ms]; None for TMS alone.
        mep_mv: peak-to-peak amplitude [mV]; None where a response was seen or not.
        asked_ms: the ISI that was asked [ms]; None where none was.
        space: the design space.

    Raises:
        InvalidValueError: swapped arguments, seconds for milliseconds, an amplitude that no muscle gives, or a pulse
            that came before the impact.
    """
    if isi_ms is not None and asked_ms is not None and off_by(isi_ms, asked_ms, space):
        _require_in_place(isi_ms, mep_mv, asked_ms, space)
    if mep_mv is not None:
        require_amplitude(mep_mv)
    if isi_ms is not None and before_impact(isi_ms, space.low_ms if asked_ms is None else asked_ms, space):
        raise InvalidValueError(
            "the magnetic pulse came before the impact, so the trial is a mistrial",
            got=f"{isi_ms:g} ms",
            remedy='Count it as one: session.mistrial("TMS before impact"), or strategy.count_mistrial(). If this '
            "happens often, begin the design space at a larger ISI.",
        )


def before_impact(isi_ms: float, commanded_isi_ms: float, space: DesignSpace) -> bool:
    """Whether a pulse came before the impact that it should have followed; such a trial is a mistrial.

    Args:
        isi_ms: the realised ISI [ms].
        commanded_isi_ms: the one that was asked [ms].
        space: says which event ISIs count from.
    """
    return space.reference == "impact" and isi_ms < 0 <= commanded_isi_ms


def require_isi_sd(isi_sd_ms: float) -> None:
    """Refuse an ISI that is known too vaguely to learn from: the models' three nodes do not stand for so wide a spread.

    Args:
        isi_sd_ms: SD of the realised ISI [ms].

    Raises:
        InvalidValueError: it is larger than `MOST_ISI_SD_MS`, negative or not finite.
    """
    if number("isi_sd_ms", isi_sd_ms, least=0) > MOST_ISI_SD_MS:
        raise InvalidValueError(
            "the realised ISI is too uncertain to learn from",
            got=f"an SD of {isi_sd_ms:g} ms",
            expected=f"at most {MOST_ISI_SD_MS:g} ms",
            remedy="Measure the impact; or count the trial as a mistrial.",
        )


def _require_in_place(isi_ms: float, mep_mv: float | None, asked_ms: float, space: DesignSpace) -> None:
    """Raise where the ISI that was asked is in the amplitude's place, or in seconds."""
    if mep_mv is not None and mep_mv > abs(isi_ms) and not off_by(mep_mv, asked_ms, space):
        raise InvalidValueError(
            "the ISI and the amplitude seem to be swapped",
            got=(isi_ms, mep_mv),
            expected=f"an ISI near the {asked_ms:g} ms that were asked, then the amplitude",
            remedy="Tell the ISI first: tell(isi_ms, mep_mv).",
        )
    if not off_by(1000 * isi_ms, asked_ms, space):
        raise InvalidValueError(
            "the realised ISI seems to be in seconds",
            got=isi_ms,
            expected=f"an ISI near the {asked_ms:g} ms that were asked",
            remedy="Tell it in ms: multiply by 1000.",
        )
