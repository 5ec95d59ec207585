"""What is odd about the amplitudes of a person, so that somebody should look: a `Doubt`, and each kind told once.

What cannot be true is refused by `isiw.signals.plausibility`; `isiw.signals.misplaced` looks at sweeps.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from scipy.special import betaln

from isiw.design import DesignSpace
from isiw.signals.plausibility import off_by
from isiw.text.found import ENOUGH_PAIRS
from isiw.trials import RESPONSE_MV

__all__ = [
    "REPEATED",
    "Doubt",
    "DoubtKind",
    "Doubts",
    "doubt_of",
    "doubt_of_isi",
    "doubts_of",
    "is_silent",
    "stopped_after",
]

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

ALIKE = ((6, 0.015), (8, 0.05))
"""So many in a row with a CV below this: from pulse to pulse MEPs have a CV of .3 and more; what a stimulator itself
puts into the EMG has less. So may mains hum, which is smaller than a response where the muscle counts as at rest."""

MANY_BELOW_MV = 0.02
"""Of a detection limit from here on, amplitudes of 0 are usual: most pulses below the threshold evoke less."""


class DoubtKind(StrEnum):
    """What is odd about data."""

    ISI_OFF = "ISI far from the one asked"
    EQUAL = "equal amplitudes"
    SILENT = "no MEP at all"
    STOPPED = "no more MEPs"
    SMALL = "small amplitudes"
    LARGE = "large amplitudes"
    JUMP = "a jump of the scale"
    MISPLACED = "a response outside the MEP window"
    ARTEFACT = "an artefact in the MEP window"
    REPEATED = "the same sweep again"


@dataclass(frozen=True)
class Doubt:
    """Something about the data that a person should look at.

    Args:
        kind: what is odd.
        text: what was seen, and the likely slip, in full sentences.
    """

    kind: DoubtKind
    text: str


REPEATED = Doubt(
    DoubtKind.REPEATED,
    "The EMG of the last trial is that of the one before, sample by sample. Does the rig wait for the new recording?",
)
"""What is odd about a sweep that is the one before."""


@dataclass(frozen=True)
class Doubts:
    """Which doubts were raised so far: each kind once, so that nobody is told the same for ever.

    Args:
        raised: their kinds.
        new: what the last trial raised; None where it raised nothing new.
    """

    raised: frozenset[DoubtKind] = frozenset()
    new: Doubt | None = None

    def after(self, *odd: Doubt | None) -> Doubts:
        """The same after one more trial.

        Args:
            *odd: what is odd since then, of which the first that is new is raised; None where nothing is.
        """
        new = next((doubt for doubt in odd if doubt is not None and doubt.kind not in self.raised), None)
        return Doubts(self.raised if new is None else self.raised | {new.kind}, new)


def doubt_of_isi(isi_ms: float | None, asked_ms: float | None, space: DesignSpace) -> Doubt | None:
    """What is odd about a realised ISI; None where nothing is.

    Args:
        isi_ms: the realised ISI [ms]; None for TMS alone.
        asked_ms: the ISI that was asked [ms]; None where none was.
        space: the design space.
    """
    if isi_ms is None or asked_ms is None or not off_by(isi_ms, asked_ms, space):
        return None
    text = f"The realised ISI of {isi_ms:g} ms is far from the {asked_ms:g} ms that were asked. Is it counted from the "
    return Doubt(DoubtKind.ISI_OFF, f"{text}{space.reference}, and in ms?")


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
        text = f"None of the first {len(meps_mv)} pulses evoked an MEP: every amplitude is 0."
        ask = "Does the stimulator fire? Is the EMG recorded? Is the intensity high enough?"
        return Doubt(DoubtKind.SILENT, f"{text} {ask}")
    knows = bool(isis_ms) and not _zeros_are_usual(detection_limit_mv)
    first = stopped_after(isis_ms, [mep_mv > 0 for mep_mv in meps_mv]) if knows else None
    if first is not None:
        text = f"None of the last {len(meps_mv) - first} pulses evoked an MEP, though earlier ones did."
        return Doubt(DoubtKind.STOPPED, f"{text} Does the stimulator still fire? Is the coil still in place?")
    return _doubt_of_scale(seen[:-IN_A_ROW], seen[-IN_A_ROW:]) if len(seen) >= IN_A_ROW else None


def _doubt_of_equals(meps_mv: Sequence[float]) -> Doubt | None:
    """What is odd about amplitudes that are one like the other."""
    last = list(meps_mv[-EQUAL_IN_A_ROW:])
    if len(last) == EQUAL_IN_A_ROW and len(set(last)) == 1 and last[0] > 0:
        text = f"The last {EQUAL_IN_A_ROW} amplitudes are exactly equal ({last[0]:g} mV). Is the EMG still "
        text += "recorded, or are amplitudes rounded too coarsely?"
        return Doubt(DoubtKind.EQUAL, text)
    for in_a_row, cv in ALIKE:
        last = list(meps_mv[-in_a_row:])
        mean_mv = statistics.fmean(last) if len(last) == in_a_row else 0.0
        if mean_mv >= RESPONSE_MV and statistics.stdev(last) < cv * mean_mv:
            text = f"The last {in_a_row} amplitudes are almost equal ({mean_mv:.3g} mV), and MEPs vary more. Is it an "
            return Doubt(DoubtKind.EQUAL, f"{text}artefact of the stimulator? Is the pulse's time right?")
    return None


def doubts_of(
    meps_mv: Sequence[float], detection_limit_mv: float | None = None, isis_ms: Sequence[float | None] = ()
) -> Doubts:
    """What was odd about amplitudes on their way; whoever goes on with them has seen it.

    Args:
        meps_mv: as for `doubt_of`.
        detection_limit_mv: as for `doubt_of`.
        isis_ms: as for `doubt_of`.
    """
    doubts = (doubt_of(meps_mv[:n], detection_limit_mv, isis_ms[:n]) for n in range(1, len(meps_mv) + 1))
    return Doubts(frozenset(doubt.kind for doubt in doubts if doubt))


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
