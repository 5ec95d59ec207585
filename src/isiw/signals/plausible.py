"""Whether an amplitude, an ISI and times can be true, of any muscle and any rig, and realised ISIs are in doubt.

A loop that reports one ISI again and again, that of the trial before, or a fraction of it, is far off in most trials. A
right rig is not: its ISIs scatter by a few ms about those asked, are all some ms longer, or are rounded to what it can
deliver.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Final

from isiw.checks import number
from isiw.design import DesignSpace
from isiw.errors import IsiwError
from isiw.findings import AMPLITUDE_MV, Finding, Kind, Severity, refused, require_percent
from isiw.trials import MOST_ISI_SD_MS

AT_REST_MV = 2e-3
"""EMG at rest has hardly ever less, since the noise of electrodes and amplifier alone has a few µV peak-to-peak; an MEP
of up to 2 mV in V has less."""

FAR_MS: Final = 20.0
"""Farther from the ISI that was asked than jitter, a constant delay and rounding to 10 ms bring a right rig [ms]."""

TOLERANCES: Final = 2
"""A space whose tolerance is wider has a rig of that kind: so many tolerances are far, if that is more."""

OF_THE_RANGE, LEAST_FAR_MS = 1 / 3, 5.0
"""In a narrow space less is far: this share of its range, and at least so much [ms]."""

SDS: Final = 3.0
"""An ISI that is not measured is far if it is so many more of its SDs away."""

FAR_ONES, AMONG = 3, 5
"""So many far ones among so many trials in a row are in doubt: single ones may be a fault of the rig."""

_OR_NONE: Final = "An amplitude below the detection limit is 0."


def implausible_amplitude(mep_mv: float) -> Finding | None:
    """Why an amplitude [mV] cannot be an MEP's, and the likely slip; None where it can, as 0 always can."""
    if mep_mv == 0 or AMPLITUDE_MV.least <= mep_mv <= AMPLITUDE_MV.most:
        return None
    slip = AMPLITUDE_MV.slip(mep_mv)
    if mep_mv > AMPLITUDE_MV.most:
        return _implausible(f"{mep_mv:.4g} mV is more than any muscle gives", f"{slip}")
    return _implausible(f"{mep_mv:.2g} mV is less than any amplifier's noise", f"{slip} {_OR_NONE}")


def _implausible(why: str, remedy: str) -> Finding:
    return Finding(Kind.IMPLAUSIBLE, Severity.REFUSED, f"the amplitude cannot be an MEP's: {why}", remedy)


def implausible_scale(meps_mv: Sequence[float]) -> Finding | None:
    """Why amplitudes at rest cannot be in mV, and the likely slip; None if one is as large as EMG at rest."""
    largest_mv = max(meps_mv, default=0.0)
    if not 0 < largest_mv < AT_REST_MV:
        return None
    return _implausible(f"{largest_mv:.2g} mV is less than EMG at rest has", f"{AMPLITUDE_MV.slip(0.0)} {_OR_NONE}")


def require_amplitude(mep_mv: float, besides: Finding | None = None) -> None:
    """Refuse an amplitude that no muscle gives."""
    found = implausible_amplitude(mep_mv) or besides
    if found is not None:
        raise refused(found, mep_mv)


def require_plausible_range(sd_mv: float, ends_mv: tuple[float, float] | None, pct_rmt: float | None) -> None:
    """Refuse ends of an interval and an SD that no muscle gives [mV], and an intensity that is not in % RMT."""
    require_percent("intensity_pct_rmt", pct_rmt)
    for end_mv in ends_mv or ():
        if AMPLITUDE_MV.most < end_mv < math.inf:
            require_amplitude(end_mv)
    if 2 * sd_mv > AMPLITUDE_MV.most:  # the SD of anything is at most half of its range
        slip = AMPLITUDE_MV.slip(2 * sd_mv)
        raise refused(_implausible(f"an SD of {sd_mv:.4g} mV is more than any muscle gives", f"{slip}"), sd_mv)


def off_by(isi_ms: float, asked_ms: float, space: DesignSpace) -> bool:
    """Whether an ISI [ms] is farther than the space's tolerance from the one that was asked [ms]."""
    return abs(isi_ms - asked_ms) > space.tolerance_ms


def isi_far(isi_ms: float | None, asked_ms: float | None, space: DesignSpace) -> Finding | None:
    """That a realised ISI is far from the one asked, which may be right; None where it is not."""
    if isi_ms is None or asked_ms is None or not off_by(isi_ms, asked_ms, space):
        return None
    text = f"The realised ISI of {isi_ms:g} ms is far from the {asked_ms:g} ms that were asked"
    return Finding(Kind.ISI_FAR, Severity.DOUBT, text, f"Is it counted from the {space.reference}, and in ms?")


def require_plausible(
    isi_ms: float | None,
    mep_mv: float | None,
    asked_ms: float | None,
    space: DesignSpace,
    isi_sd_ms: float = 0.0,
) -> None:
    """Refuse what cannot be true of one trial, or is a mistrial."""
    if isi_ms is not None and asked_ms is not None and off_by(isi_ms, asked_ms, space):
        found = _misplaced_value(isi_ms, mep_mv, asked_ms, space)
        if found is not None:
            raise refused(found, (isi_ms, mep_mv), f"an ISI near the {asked_ms:g} ms that were asked")
    if mep_mv is not None:
        require_amplitude(mep_mv)
    if isi_ms is not None and before_impact(isi_ms, space.low_ms if asked_ms is None else asked_ms, space):
        raise refused(_EARLY, f"{isi_ms:g} ms")
    if number("isi_sd_ms", isi_sd_ms, least=0) > MOST_ISI_SD_MS:
        raise refused(_VAGUE, f"an SD of {isi_sd_ms:g} ms", f"at most {MOST_ISI_SD_MS:g} ms")


_EARLY: Final = Finding(
    Kind.TMS_BEFORE_IMPACT,
    Severity.REFUSED,
    "the magnetic pulse came before the impact, so the trial is a mistrial",
    'Count it as one: session.mistrial("TMS before impact"), or strategy.count_mistrial(). If this happens often, '
    "begin the design space at a larger ISI.",
)

_VAGUE: Final = Finding(
    Kind.VAGUE_ISI,
    Severity.REFUSED,
    "the realised ISI is too uncertain to learn from",
    "Measure the impact; or count the trial as a mistrial.",
)


def before_impact(isi_ms: float, commanded_isi_ms: float, space: DesignSpace) -> bool:
    """Whether a pulse came before the impact that it should have followed; such a trial is a mistrial."""
    return space.reference == "impact" and isi_ms < 0 <= commanded_isi_ms


def _misplaced_value(isi_ms: float, mep_mv: float | None, asked_ms: float, space: DesignSpace) -> Finding | None:
    """That the ISI that was asked is in the amplitude's place, or in seconds; None where it is not."""
    if mep_mv is not None and mep_mv > abs(isi_ms) and not off_by(mep_mv, asked_ms, space):
        remedy = "Tell the ISI first: tell(isi_ms, mep_mv)."
        return Finding(Kind.ORDER, Severity.REFUSED, "the ISI and the amplitude seem to be swapped", remedy)
    if not off_by(1000 * isi_ms, asked_ms, space):
        remedy = "Tell it in ms: multiply by 1000."
        return Finding(Kind.IN_SECONDS, Severity.REFUSED, "the realised ISI seems to be in seconds", remedy)
    return None


def far_ms(space: DesignSpace) -> float:
    """The distance from the ISI that was asked beyond which a realised one is far [ms]."""
    narrow_ms = max(LEAST_FAR_MS, OF_THE_RANGE * (space.high_ms - space.low_ms))
    return min(max(FAR_MS, TOLERANCES * space.tolerance_ms), narrow_ms)


def is_far(off_ms: float, space: DesignSpace, isi_sd_ms: float = 0.0) -> bool:
    """Whether a realised ISI is far from the one that was asked, by their difference [ms]."""
    return abs(off_ms) > far_ms(space) + SDS * isi_sd_ms


def doubtful_from(far: Sequence[bool]) -> int | None:
    """The first of some trials that is in doubt, and with it all after it, by which of them are far; None if none is.

    Those between the far ones are in doubt, too: a wrong ISI may be near the right one by chance.
    """
    for first, is_first in enumerate(far):
        if is_first and sum(far[first : first + AMONG]) >= FAR_ONES:
            return first
    return None


def unconfirmed(doubted: Collection[int], space: DesignSpace, instead: str) -> IsiwError:
    """The error if an outcome is reported while realised ISIs are in doubt.

    Args:
        doubted: the numbers of the trials in doubt.
        space: the space that was asked from.
        instead: what to do where they are wrong, as a clause.
    """
    found = Finding(
        Kind.ISIS_FAR,
        Severity.REFUSED,
        "realised ISIs are far from those that were asked for, and are not confirmed",
        "Does your loop report the ISI that was delivered in this very trial, in ms, and from the event that ISIs "
        "count from? If they are right, report this outcome with confirm=True, and they count. If they are wrong, "
        f"{instead}.",
    )
    numbers = ", ".join(map(str, sorted(doubted)))
    return refused(
        found, f"trials in doubt: {numbers}", f"ISIs within {far_ms(space):g} ms of those that were asked for"
    )
