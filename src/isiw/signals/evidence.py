"""What is known after each trial, which all checks of a rig look at, and what the amplitudes told so far show.

What cannot be true is refused (`isiw.signals.limits`); `isiw.signals.places` looks at what sweeps show besides.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeAlias

from isiw.findings import ENOUGH_PAIRS, Finding, Kind, Severity
from isiw.lazy import scipy
from isiw.signals.limits import SignalLimits
from isiw.signals.mep import Disturbance
from isiw.trials import RESPONSE_MV, Measurement, Sweep, Trial

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


def _doubt(kind: Kind, text: str, remedy: str) -> Finding:
    return Finding(kind, Severity.DOUBT, text, remedy)


def equal(evidence: Evidence) -> Finding | None:
    """Amplitudes that are one like the other."""
    meps_mv = _meps_mv(evidence.told)
    last = meps_mv[-EQUAL_IN_A_ROW:]
    if len(last) == EQUAL_IN_A_ROW and len(set(last)) == 1 and last[0] > 0:
        text = f"The last {EQUAL_IN_A_ROW} amplitudes are exactly equal ({last[0]:g} mV)"
        return _doubt(Kind.EQUAL, text, "Is the EMG still recorded, or are amplitudes rounded too coarsely?")
    for in_a_row, cv in ALIKE:
        last = meps_mv[-in_a_row:]
        mean_mv = statistics.fmean(last) if len(last) == in_a_row else 0.0
        if mean_mv >= RESPONSE_MV and math.dist(last, [mean_mv] * in_a_row) < cv * mean_mv * math.sqrt(in_a_row - 1):
            text = f"The last {in_a_row} amplitudes are almost equal ({mean_mv:.3g} mV), and MEPs vary more"
            return _doubt(Kind.EQUAL, text, "Is it an artefact of the stimulator? Is the pulse's time right?")
    return None


def silent(evidence: Evidence) -> Finding | None:
    """No MEP from the start on."""
    meps_mv = _meps_mv(evidence.told)
    if len(meps_mv) < SILENT_FROM_THE_START or not is_silent(meps_mv, evidence.detection_limit_mv):
        return None
    text = f"None of the first {len(meps_mv)} pulses evoked an MEP: every amplitude is 0"
    ask = "Does the stimulator fire? Is the EMG recorded? Is the intensity high enough?"
    return _doubt(Kind.SILENT, text, ask)


def stopped(evidence: Evidence) -> Finding | None:
    """No MEP any more, though there were some."""
    told = evidence.told
    usual = _zeros_are_usual(evidence.detection_limit_mv)
    first = None if usual else stopped_after([one.isi_ms for one in told], [one.stands_out for one in told])
    if first is None:
        return None
    text = f"None of the last {len(told) - first} pulses evoked an MEP, though earlier ones did"
    return _doubt(Kind.STOPPED, text, "Does the stimulator still fire? Is the coil still in place?")


def small(evidence: Evidence) -> Finding | None:
    """Amplitudes below EMG at rest."""
    last = _seen_mv(evidence.told)[-IN_A_ROW:]
    if len(last) < IN_A_ROW or max(last) >= SMALL_MV:
        return None
    text = f"The last {IN_A_ROW} amplitudes are below {1e3 * max(last):.2g} µV, less than EMG at rest has"
    return _doubt(Kind.SMALL, text, "Are they in V? Or is the amplifier off, or its gain applied twice?")


def large(evidence: Evidence) -> Finding | None:
    """Amplitudes that are large from the start, or larger by more than any muscle changes."""
    seen = _seen_mv(evidence.told)
    earlier, last = seen[:-IN_A_ROW], seen[-IN_A_ROW:]
    if len(last) < IN_A_ROW or (usual_mv := statistics.geometric_mean(last)) < LARGE_MV:
        return None
    if not earlier:
        text = f"The first {IN_A_ROW} amplitudes are {usual_mv:.2g} mV in the mean, more than most muscles give"
        return _doubt(Kind.LARGE, text, "Are they in µV? Divide by 1000.")
    times = usual_mv / statistics.median(earlier)
    if times < JUMP:
        return None
    text = f"The last {IN_A_ROW} amplitudes are {times:.0f} times as large as those before"
    return _doubt(Kind.JUMP, text, "Has their unit changed, from mV to µV or from V to mV?")


def is_silent(meps_mv: Sequence[float], detection_limit_mv: float | None = None) -> bool:
    """Whether enough amplitudes were told, and each is 0, where the detection limit is too low for that."""
    enough = len(meps_mv) >= ENOUGH_PAIRS and not _zeros_are_usual(detection_limit_mv)
    return enough and not any(meps_mv)


def stopped_after(isis_ms: Sequence[float | None], answered: Sequence[bool]) -> int | None:
    """After how many pulses there was no answer any more; None where chance may explain those without one.

    Only pulses between ISIs that were answered count: what lies beyond may never have been answered.
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
    by_chance = math.exp(
        scipy.special.betaln(hits + 1, misses + silent + 1) - scipy.special.betaln(hits + 1, misses + 1)
    )
    return first if by_chance < STOPPED_BY_CHANCE else None


def _meps_mv(told: Sequence[Told]) -> list[float]:
    return [one.mep_mv for one in told]


def _seen_mv(told: Sequence[Told]) -> list[float]:
    """The amplitudes above the detection limit."""
    return [one.mep_mv for one in told if one.mep_mv > 0]


def _zeros_are_usual(detection_limit_mv: float | None) -> bool:
    """Whether amplitudes of 0 say little, since much is below the detection limit."""
    return detection_limit_mv is not None and detection_limit_mv >= MANY_BELOW_MV


OF_REST: Final = 8.0
"""Peak-to-peak amplitude of EMG at rest over its RMS, at most: some 6 within the window of an MEP. In 330 recorded and
simulated sweeps without an MEP it was 7.3 outside of it at most."""


class Response(NamedTuple):
    """A response outside the MEP window: its centre [ms after the pulse], and its peak-to-peak amplitude [mV]."""

    at_ms: float
    size_mv: float


@dataclass(frozen=True)
class Told:
    """A trial that counts, as the checks of several trials look at it.

    Args:
        mep_mv: its amplitude [mV]; 0 is below the detection limit.
        isi_ms: its ISI [ms]; None for TMS alone.
        rest_uv: EMG before the pulse [µV RMS]; None where not known.
        outside: the largest clear response outside the MEP window; None where there is none, or no sweep.
        cut_ms: from when to when the EMG responds [ms after the pulse], if it is larger behind the window than within.
        disturbance: the mains hum and the drift that were subtracted; None if there is none.
        is_tail: whether what is in the window is the end of a larger artefact before it.
        only_falls: whether what is in the window only falls, as a slow decay does and no MEP.
        repeats: whether its EMG is that of the trial before, sample by sample.
    """

    mep_mv: float
    isi_ms: float | None = None
    rest_uv: float | None = None
    outside: Response | None = None
    cut_ms: tuple[float, float] | None = None
    disturbance: Disturbance | None = None
    is_tail: bool = False
    only_falls: bool = False
    repeats: bool = False

    @property
    def stands_out(self) -> bool:
        """Whether its amplitude is above the detection limit, and larger than EMG at rest may be."""
        return self.mep_mv > OF_REST * (self.rest_uv or 0.0) / 1000


def told_of(trials: Iterable[Trial]) -> tuple[Told, ...]:
    """Those of some trials that count and have an amplitude."""
    return tuple(Told(t.mep_mv, t.isi_ms, t.background_rms_uv) for t in trials if t.told and t.mep_mv is not None)


_USUAL_LIMITS: Final = SignalLimits()


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is known after a trial; what is not known is None or empty.

    Args:
        trial: the last trial, as it was judged.
        answer: what the device answered.
        limits: what it was judged by.
        told: the trials that count so far, in order.
        detection_limit_mv: what an amplitude of 0 is known to be below [mV]; None where nobody has said.
    """

    trial: Trial | None = None
    answer: Sweep | Measurement | None = None
    limits: SignalLimits = _USUAL_LIMITS
    told: Sequence[Told] = ()
    detection_limit_mv: float | None = None


Check: TypeAlias = Callable[[Evidence], Finding | None]
"""Looks for one kind of finding; None where it finds nothing, or lacks what it needs."""


def of_sweep(find: Callable[[Sweep, Trial], Finding | None]) -> Check:
    """A check that needs the last trial and its sweep."""
    return lambda e: find(e.answer, e.trial) if e.trial is not None and isinstance(e.answer, Sweep) else None


def of_trial(find: Callable[[Trial, Evidence], Finding | None]) -> Check:
    """A check that needs the last trial, be there a sweep or not."""
    return lambda e: None if e.trial is None else find(e.trial, e)


def of_told(find: Check) -> Check:
    """A check that needs the trials that count so far."""
    return lambda e: find(e) if e.told else None
