"""The amplitudes so far: what is odd about them, whatever their waveforms show.

Each kind of doubt about several trials is raised once.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Final, NamedTuple

from isiw.findings import Finding, Kind, Severity, zeros_are_usual
from isiw.lazy import scipy
from isiw.trials import RESPONSE_MV, Trial

if TYPE_CHECKING:
    from isiw.signals.mep import Disturbance

OF_REST: Final = 8.0
"""Peak-to-peak amplitude of EMG at rest over its RMS, at most: some 6 within the window of an MEP. In 330 recorded and
simulated sweeps without an MEP it was 7.3 outside of it at most."""


class Response(NamedTuple):
    """A response outside the MEP window: its centre [ms after the pulse], and its peak-to-peak amplitude [mV]."""

    at_ms: float
    size_mv: float


@dataclass(frozen=True)
class Counted:
    """A trial that counts, as the checks of several trials look at it."""

    mep_mv: float  # 0 is below the detection limit
    isi_ms: float | None = None  # None for TMS alone
    rest_uv: float | None = None  # RMS before the pulse
    outside: Response | None = None  # the largest clear one outside the MEP window
    cut_ms: tuple[float, float] | None = None  # of the response after the pulse, if it is larger behind the window
    disturbance: Disturbance | None = None  # which was subtracted
    is_tail: bool = False  # the window holds the end of a larger artefact before it
    only_falls: bool = False  # the EMG in the window only falls, as a slow decay does and no MEP
    repeats: bool = False  # its EMG is that of the trial before, sample by sample

    @property
    def stands_out(self) -> bool:
        """Whether its amplitude is above the detection limit, and larger than EMG at rest may be."""
        return self.mep_mv > OF_REST * (self.rest_uv or 0.0) / 1000


def counted_of(trials: Iterable[Trial]) -> tuple[Counted, ...]:
    """Those of some trials that count and have an amplitude, at the intensity of the pairs."""
    comparable = (t for t in trials if t.told and t.intensity_pct_rmt is None)
    return tuple(Counted(t.mep_mv, t.isi_ms, t.background_rms_uv) for t in comparable if t.mep_mv is not None)


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


def _doubt(kind: Kind, text: str, remedy: str) -> Finding:
    return Finding(kind, Severity.DOUBT, text, remedy)


def equal(told: Sequence[Counted]) -> Finding | None:
    """Amplitudes that are one like the other."""
    meps_mv = [one.mep_mv for one in told[-max(in_a_row for in_a_row, _ in ALIKE) :]]
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


def silent(told: Sequence[Counted]) -> Finding | None:
    """No MEP from the start on."""
    if len(told) < SILENT_FROM_THE_START or any(one.mep_mv for one in told):
        return None
    text = f"None of the first {len(told)} pulses evoked an MEP: every amplitude is 0"
    ask = "Does the stimulator fire? Is the EMG recorded? Is the intensity high enough?"
    return _doubt(Kind.SILENT, text, ask)


def stopped(told: Sequence[Counted]) -> Finding | None:
    """No MEP any more, though there were some."""
    if any(one.stands_out for one in told[-STOPPED_IN_A_ROW:]):
        return None
    first = stopped_after([one.isi_ms for one in told], [one.stands_out for one in told])
    if first is None:
        return None
    text = f"None of the last {len(told) - first} pulses evoked an MEP, though earlier ones did"
    return _doubt(Kind.STOPPED, text, "Does the stimulator still fire? Is the coil still in place?")


def small(told: Sequence[Counted]) -> Finding | None:
    """Amplitudes below EMG at rest."""
    last = _last_seen_mv(told)
    if len(last) < IN_A_ROW or max(last) >= SMALL_MV:
        return None
    text = f"The last {IN_A_ROW} amplitudes are below {1e3 * max(last):.2g} µV, less than EMG at rest has"
    return _doubt(Kind.SMALL, text, "Are they in V? Or is the amplifier off, or its gain applied twice?")


def large(told: Sequence[Counted]) -> Finding | None:
    """Amplitudes that are large from the start, or larger by more than any muscle changes."""
    last = _last_seen_mv(told)
    if len(last) < IN_A_ROW or (usual_mv := statistics.geometric_mean(last)) < LARGE_MV:
        return None
    earlier = [one.mep_mv for one in told if one.mep_mv > 0][:-IN_A_ROW]
    if not earlier:
        text = f"The first {IN_A_ROW} amplitudes are {usual_mv:.2g} mV in the mean, more than most muscles give"
        return _doubt(Kind.LARGE, text, "Are they in µV? Divide by 1000.")
    times = usual_mv / statistics.median(earlier)
    if times < JUMP:
        return None
    text = f"The last {IN_A_ROW} amplitudes are {times:.0f} times as large as those before"
    return _doubt(Kind.JUMP, text, "Has their unit changed, from mV to µV or from V to mV?")


def stopped_after(isis_ms: Sequence[float | None], answered: Sequence[bool]) -> int | None:
    """After how many pulses there was no answer any more, at ISIs between answered ones; None if that may be chance."""
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


def _last_seen_mv(told: Sequence[Counted]) -> list[float]:
    """The last amplitudes above the detection limit."""
    seen = islice((one.mep_mv for one in reversed(told) if one.mep_mv > 0), IN_A_ROW)
    return list(seen)[::-1]


def odd_amplitudes(told: Sequence[Counted], detection_limit_mv: float | None = None) -> Iterator[Finding]:
    """What is odd about the amplitudes so far, in the order of the checks.

    Args:
        told: the trials that count so far.
        detection_limit_mv: below which an amplitude is 0 [mV]; None if it is unknown.
    """
    of_zeros = () if zeros_are_usual(detection_limit_mv) else (silent, stopped)
    yield from filter(None, (find(told) for find in (equal, *of_zeros, small, large)))


@dataclass(frozen=True)
class Doubts:
    """Which kinds of doubt were `raised` so far, each once, and which the last trial raised, or None."""

    raised: frozenset[Kind] = frozenset()
    new: Finding | None = None

    @classmethod
    def seen(cls, told: tuple[Counted, ...], detection_limit_mv: float | None = None) -> Doubts:
        """What was odd about amplitudes on their way; whoever goes on with them has seen it."""
        ways = (odd_amplitudes(told[:n], detection_limit_mv) for n in range(1, len(told) + 1))
        return cls(frozenset(finding.kind for way in ways for finding in way))

    def after(self, odd: Iterable[Finding | None]) -> Doubts:
        """The same after one more trial: of what is odd since then, the first that is new is raised."""
        new = next((doubt for doubt in odd if doubt is not None and doubt.kind not in self.raised), None)
        return Doubts(self.raised if new is None else self.raised | {new.kind}, new)
