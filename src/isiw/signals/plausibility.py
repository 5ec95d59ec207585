"""Whether amplitudes and ISIs can be true, and which slip they look like where they cannot.

What no muscle and no amplifier gives is refused: `require_plausible`. What is only odd is a `Doubt` that a person
should look at: `doubt_of`. The bounds leave room for every muscle: the EMG at rest has 2 to 30 µV peak-to-peak, the
largest compound action potentials some 25 mV.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from scipy.special import betaln

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.text.found import ENOUGH_PAIRS
from isiw.trials import RESPONSE_MV

__all__ = [
    "Doubt",
    "DoubtKind",
    "Slip",
    "doubt_of",
    "doubts_of",
    "implausible_amplitude",
    "implausible_scale",
    "is_silent",
    "off_by",
    "require_amplitude",
    "require_plausible",
    "stopped_after",
]

SMALLEST_MV = 2e-4
"""No EMG amplifier is so quiet: the noise of the electrodes alone has more."""

LARGEST_MV = 30.0

AT_REST_MV = 2e-3
"""EMG at rest has hardly ever less, since the noise of electrodes and amplifier alone has a few µV peak-to-peak; an MEP
of up to 2 mV that is told in V has less."""

SMALL_MV, LARGE_MV = 8e-4, 4.0
"""Of several in a row, the largest is never smaller, and their geometric mean is hardly ever larger from the start."""

JUMP = 300.0
"""From EMG at rest to a large MEP there is a factor of 200 at most; from one unit to the next there are 1,000."""

IN_A_ROW = 3
EQUAL_IN_A_ROW = 4
SILENT_FROM_THE_START = 10

STOPPED_IN_A_ROW = 10
STOPPED_BY_CHANCE = 1e-4
"""So many pulses without an answer, after some with one, are due to chance less often than this."""

ALIKE_IN_A_ROW = 6
ALIKE_CV = 0.015
"""From pulse to pulse MEPs have a CV of .3 and more; what a stimulator itself puts into the EMG has less than this. So
may mains hum, which is smaller than a response where the muscle counts as at rest."""

MANY_BELOW_MV = 0.02
"""Of a detection limit from here on, amplitudes of 0 are usual: most pulses below the threshold evoke less."""


class DoubtKind(StrEnum):
    """What is odd about data."""

    ISI_OFF = "ISI far from the one asked"
    EQUAL = "equal amplitudes"
    SILENT = "no MEP at all"
    STOPPED = "no MEP any more"
    SMALL = "small amplitudes"
    LARGE = "large amplitudes"
    JUMP = "a jump of the scale"


@dataclass(frozen=True)
class Doubt:
    """Something about the data that a person should look at.

    Args:
        kind: what is odd.
        text: what was seen, and the likely slip, in full sentences.
    """

    kind: DoubtKind
    text: str


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


def require_plausible(
    isi_ms: float | None, mep_mv: float | None, asked_ms: float | None, space: DesignSpace
) -> Doubt | None:
    """Refuse what cannot be true of one trial; the doubt about what is only odd.

    Args:
        isi_ms: the realised ISI [ms]; None for TMS alone.
        mep_mv: peak-to-peak amplitude [mV]; None where a response was seen or not.
        asked_ms: the ISI that was asked [ms]; None where none was.
        space: the design space.

    Raises:
        InvalidValueError: swapped arguments, seconds for milliseconds, or an amplitude that no muscle gives.
    """
    odd = isi_ms is not None and asked_ms is not None and off_by(isi_ms, asked_ms, space)
    if odd and isi_ms is not None and asked_ms is not None:
        _require_in_place(isi_ms, mep_mv, asked_ms, space)
    if mep_mv is not None:
        require_amplitude(mep_mv)
    if not odd:
        return None
    text = f"The realised ISI of {isi_ms:g} ms is far from the {asked_ms:g} ms that were asked. Is it counted from the "
    return Doubt(DoubtKind.ISI_OFF, f"{text}{space.reference}, and in ms?")


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


def doubt_of(
    meps_mv: Sequence[float], detection_limit_mv: float | None = None, isis_ms: Sequence[float | None] = ()
) -> Doubt | None:
    """What is odd about the last amplitudes of a person; None where nothing is.

    Args:
        meps_mv: all amplitudes told so far [mV], in order; 0 is below the detection limit.
        detection_limit_mv: what an amplitude of 0 is known to be below [mV]; None where nobody has said.
        isis_ms: the ISIs of the same trials [ms]; without them nobody can say whether answers have stopped.
    """
    alike = _doubt_of_equals(meps_mv)
    if alike is not None:
        return alike
    seen = [mep_mv for mep_mv in meps_mv if mep_mv > 0]
    if len(meps_mv) >= SILENT_FROM_THE_START and is_silent(meps_mv, detection_limit_mv):
        text = f"None of the first {len(meps_mv)} pulses gave an MEP: every amplitude is 0."
        ask = "Does the stimulator fire, is the EMG recorded, is the intensity enough?"
        return Doubt(DoubtKind.SILENT, f"{text} {ask}")
    knows = bool(isis_ms) and not _zeros_are_usual(detection_limit_mv)
    first = stopped_after(isis_ms, [mep_mv > 0 for mep_mv in meps_mv]) if knows else None
    if first is not None:
        text = f"None of the last {len(meps_mv) - first} pulses gave an MEP, though earlier ones did."
        return Doubt(DoubtKind.STOPPED, f"{text} Does the stimulator still fire, is the coil in its place?")
    return _doubt_of_scale(seen[:-IN_A_ROW], seen[-IN_A_ROW:]) if len(seen) >= IN_A_ROW else None


def _doubt_of_equals(meps_mv: Sequence[float]) -> Doubt | None:
    """What is odd about amplitudes that are one like the other."""
    last = list(meps_mv[-EQUAL_IN_A_ROW:])
    if len(last) == EQUAL_IN_A_ROW and len(set(last)) == 1 and last[0] > 0:
        text = f"The last {EQUAL_IN_A_ROW} amplitudes are exactly equal ({last[0]:g} mV). Is the EMG still recorded?"
        return Doubt(DoubtKind.EQUAL, text)
    last = list(meps_mv[-ALIKE_IN_A_ROW:])
    mean_mv = statistics.fmean(last) if len(last) == ALIKE_IN_A_ROW else 0.0
    if mean_mv < RESPONSE_MV or statistics.stdev(last) >= ALIKE_CV * mean_mv:
        return None
    text = f"The last {ALIKE_IN_A_ROW} amplitudes are almost equal ({mean_mv:.3g} mV), and MEPs vary more. Is it an "
    return Doubt(DoubtKind.EQUAL, f"{text}artefact of the stimulator? Is the pulse's time right?")


def doubts_of(
    meps_mv: Sequence[float], detection_limit_mv: float | None = None, isis_ms: Sequence[float | None] = ()
) -> frozenset[DoubtKind]:
    """What was odd about amplitudes on their way; whoever goes on with them has seen it.

    Args:
        meps_mv: as for `doubt_of`.
        detection_limit_mv: as for `doubt_of`.
        isis_ms: as for `doubt_of`.
    """
    doubts = (doubt_of(meps_mv[:n], detection_limit_mv, isis_ms[:n]) for n in range(1, len(meps_mv) + 1))
    return frozenset(doubt.kind for doubt in doubts if doubt)


def is_silent(meps_mv: Sequence[float], detection_limit_mv: float | None = None) -> bool:
    """Whether enough amplitudes were told, and each is 0, where the detection limit is too low for that.

    Args:
        meps_mv: as for `doubt_of`.
        detection_limit_mv: as for `doubt_of`.
    """
    enough = len(meps_mv) >= ENOUGH_PAIRS and not _zeros_are_usual(detection_limit_mv)
    return enough and not any(meps_mv)


def stopped_after(isis_ms: Sequence[float | None], answered: Sequence[bool]) -> int | None:
    """After how many pulses there was no answer any more; None where chance may explain those without one.

    Only pulses between ISIs that were answered count: what lies beyond may never have been answered.

    Args:
        isis_ms: the ISI of each pulse so far [ms], in order; None for TMS alone.
        answered: whether each was answered.
    """
    first = max((index + 1 for index, yes in enumerate(answered) if yes), default=0)
    with_answer = [isi_ms for isi_ms, yes in zip(isis_ms, answered, strict=True) if yes]
    pairs_ms = [isi_ms for isi_ms in with_answer if isi_ms is not None]
    low_ms, high_ms = min(pairs_ms, default=math.inf), max(pairs_ms, default=-math.inf)
    comparable = [None in with_answer if isi_ms is None else low_ms <= isi_ms <= high_ms for isi_ms in isis_ms]
    hits, silent = len(with_answer), sum(comparable[first:])
    if not hits or silent < STOPPED_IN_A_ROW:
        return None
    misses = sum(comparable[:first]) - hits
    # How probable so many misses are after these, whatever the share of answers is.
    by_chance = math.exp(betaln(hits + 1, misses + silent + 1) - betaln(hits + 1, misses + 1))
    return first if by_chance < STOPPED_BY_CHANCE else None


def _zeros_are_usual(detection_limit_mv: float | None) -> bool:
    """Whether amplitudes of 0 say little, since much is below the detection limit."""
    return detection_limit_mv is not None and detection_limit_mv >= MANY_BELOW_MV


def _doubt_of_scale(earlier: Sequence[float], last: Sequence[float]) -> Doubt | None:
    usual_mv = statistics.geometric_mean(last)
    if max(last) < SMALL_MV:
        text = f"The last {IN_A_ROW} amplitudes are below {1e3 * max(last):.2g} µV, less than EMG at rest has."
        return Doubt(DoubtKind.SMALL, f"{text} Are they in V? Or is the amplifier off, or its gain applied twice?")
    if usual_mv < LARGE_MV:
        return None
    if not earlier:
        text = f"The first {IN_A_ROW} amplitudes are {usual_mv:.2g} mV in the mean, more than most muscles give."
        return Doubt(DoubtKind.LARGE, f"{text} Are they in µV? Divide by 1000.")
    before_mv = statistics.median(earlier)
    if usual_mv < JUMP * before_mv:
        return None
    text = f"The last {IN_A_ROW} amplitudes are {usual_mv / before_mv:.0f} times as large as those before."
    return Doubt(DoubtKind.JUMP, f"{text} Has their unit changed, from mV to µV or from V to mV?")
