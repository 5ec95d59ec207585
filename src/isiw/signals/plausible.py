"""What numbers alone say, be there a waveform or not: which cannot be true, and what is odd about those so far.

A value that no muscle and no rig gives is refused. Each kind of doubt about several trials is raised once. A loop that
reports one ISI again and again, that of the trial before, or a fraction of it, is far off in most trials. A right rig
is not: its ISIs scatter by a few ms about those asked, are all some ms longer, or are rounded to what it can deliver.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from isiw.checks import number
from isiw.design import DesignSpace
from isiw.errors import IsiwError
from isiw.findings import AMPLITUDE_MV, BACKGROUND_LIMIT_UV, Finding, Kind, Severity, refused, require_percent
from isiw.lazy import scipy
from isiw.summary import ENOUGH_PAIRS
from isiw.trials import MOST_ISI_SD_MS, RESPONSE_MV, Trial

if TYPE_CHECKING:
    from isiw.signals.mep import Disturbance

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


def odd_background(rms_uv: float | None) -> Finding | None:
    """That EMG before the pulse [µV RMS] is probably in another unit; None where it is not, or is 0 or not known."""
    if not rms_uv or (slip := BACKGROUND_LIMIT_UV.slip(rms_uv)) is None:
        return None
    kind, than = (Kind.QUIET, "less than any amplifier has") if rms_uv < 1 else (Kind.LOUD, "more than any muscle has")
    return Finding(kind, Severity.DOUBT, f"A background of {rms_uv:.2g} µV RMS is {than}", slip)


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
    isi_ms: float | None, mep_mv: float | None, asked_ms: float | None, space: DesignSpace, isi_sd_ms: float = 0.0
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


class _Measured(Protocol):
    """A trial or its outcome: its amplitude, or the interval that it lies in [mV]."""

    @property
    def mep_mv(self) -> float | None: ...
    @property
    def mep_interval_mv(self) -> tuple[float, float] | None: ...


MANY_BELOW_MV: Final = 0.02
"""Of a detection limit from here on, amplitudes of 0 are usual: most pulses below the threshold evoke less."""


def zeros_are_usual(detection_limit_mv: float | None) -> bool:
    """Whether amplitudes of 0 say little, since much is below the detection limit."""
    return detection_limit_mv is not None and detection_limit_mv >= MANY_BELOW_MV


def is_silent(outcomes: Sequence[_Measured], detection_limit_mv: float | None = None) -> bool:
    """Whether enough amplitudes count and no MEP was seen, where the detection limit is too low for that."""
    meps_mv = [one.mep_mv for one in outcomes if one.mep_mv is not None]
    above = any((one.mep_interval_mv or (0.0,))[0] or getattr(one, "response", None) for one in outcomes)
    return len(meps_mv) >= ENOUGH_PAIRS and not (zeros_are_usual(detection_limit_mv) or any(meps_mv) or above)


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
    return list(islice((one.mep_mv for one in reversed(told) if one.mep_mv > 0), IN_A_ROW))[::-1]


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
