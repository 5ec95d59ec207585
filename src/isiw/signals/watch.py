"""Looks at each trial and the amplitudes so far for what is wrong, and says when a person should look at it.

A finding in one trial counts only after several in a row; each kind of doubt about several trials is raised once.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Final

from isiw.design import DesignSpace
from isiw.findings import ENOUGH_PAIRS, Finding, Kind, Severity
from isiw.lazy import scipy
from isiw.signals import places, rig
from isiw.signals.limits import SignalLimits
from isiw.signals.places import told_by
from isiw.signals.rig import REMEDIES, Evidence, Told, told_of, too_early_by_chance
from isiw.trials import RESPONSE_MV, Measurement, Sweep, Trial, TrialTable
from isiw.types import FloatArray

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
    meps_mv = [one.mep_mv for one in evidence.told[-max(in_a_row for in_a_row, _ in ALIKE) :]]
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
    told = evidence.told
    if len(told) < SILENT_FROM_THE_START or any(one.mep_mv for one in told):
        return None
    if _zeros_are_usual(evidence.detection_limit_mv):
        return None
    text = f"None of the first {len(told)} pulses evoked an MEP: every amplitude is 0"
    ask = "Does the stimulator fire? Is the EMG recorded? Is the intensity high enough?"
    return _doubt(Kind.SILENT, text, ask)


def stopped(evidence: Evidence) -> Finding | None:
    """No MEP any more, though there were some."""
    told = evidence.told
    if _zeros_are_usual(evidence.detection_limit_mv) or any(one.stands_out for one in told[-STOPPED_IN_A_ROW:]):
        return None
    first = stopped_after([one.isi_ms for one in told], [one.stands_out for one in told])
    if first is None:
        return None
    text = f"None of the last {len(told) - first} pulses evoked an MEP, though earlier ones did"
    return _doubt(Kind.STOPPED, text, "Does the stimulator still fire? Is the coil still in place?")


def small(evidence: Evidence) -> Finding | None:
    """Amplitudes below EMG at rest."""
    last = _last_seen_mv(evidence.told)
    if len(last) < IN_A_ROW or max(last) >= SMALL_MV:
        return None
    text = f"The last {IN_A_ROW} amplitudes are below {1e3 * max(last):.2g} µV, less than EMG at rest has"
    return _doubt(Kind.SMALL, text, "Are they in V? Or is the amplifier off, or its gain applied twice?")


def large(evidence: Evidence) -> Finding | None:
    """Amplitudes that are large from the start, or larger by more than any muscle changes."""
    last = _last_seen_mv(evidence.told)
    if len(last) < IN_A_ROW or (usual_mv := statistics.geometric_mean(last)) < LARGE_MV:
        return None
    earlier = [one.mep_mv for one in evidence.told if one.mep_mv > 0][:-IN_A_ROW]
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


def _last_seen_mv(told: Sequence[Told]) -> list[float]:
    """The last amplitudes above the detection limit."""
    seen = islice((one.mep_mv for one in reversed(told) if one.mep_mv > 0), IN_A_ROW)
    return list(seen)[::-1]


def _zeros_are_usual(detection_limit_mv: float | None) -> bool:
    """Whether amplitudes of 0 say little, since much is below the detection limit."""
    return detection_limit_mv is not None and detection_limit_mv >= MANY_BELOW_MV


OF_SWEEP: Final = (rig.unusable_emg, rig.wrong_acceleration, rig.no_origin, rig.double_pulse, rig.stray_edge)
"""Checks of the last trial and its sweep, the surest first: the first finding explains the others."""

OF_TRIAL: Final = (rig.wrong_level, rig.lost_trial)
"""Checks of the last trial, be there a sweep or not."""

OF_TOLD: Final = (
    places.repeated,
    equal,
    silent,
    stopped,
    small,
    large,
    places.hum,
    places.drift,
    places.misplaced,
    places.cut_off,
    places.artefact,
    places.decay,
)
"""Checks of the trials that count so far."""


def findings(evidence: Evidence) -> Iterator[Finding]:
    """What is found in some evidence, in the order of the checks."""
    trial, answer = evidence.trial, evidence.answer
    if trial is not None and isinstance(answer, Sweep):
        yield from filter(None, (find(answer, trial) for find in OF_SWEEP))
    if trial is not None:
        yield from filter(None, (find(trial, evidence) for find in OF_TRIAL))
    if evidence.told:
        yield from filter(None, (find(evidence) for find in OF_TOLD))


EARLY_IN_A_ROW: Final = 9
"""By chance a pulse is early at one ISI a few times in a row; after three, strategies that may choose ask elsewhere."""


@dataclass(frozen=True)
class Doubts:
    """Which kinds of doubt were `raised` so far, each once, and which the last trial raised, or None."""

    raised: frozenset[Kind] = frozenset()
    new: Finding | None = None

    @classmethod
    def seen(cls, told: tuple[Told, ...], detection_limit_mv: float | None = None) -> Doubts:
        """What was odd about amplitudes on their way; whoever goes on with them has seen it."""
        ways = (Evidence(told=told[:n], detection_limit_mv=detection_limit_mv) for n in range(1, len(told) + 1))
        return cls(frozenset(finding.kind for way in ways for finding in findings(way)))

    def after(self, odd: Iterable[Finding | None]) -> Doubts:
        """The same after one more trial: of what is odd since then, the first that is new is raised."""
        new = next((doubt for doubt in odd if doubt is not None and doubt.kind not in self.raised), None)
        return Doubts(self.raised if new is None else self.raised | {new.kind}, new)


@dataclass(frozen=True)
class Watch:
    """What was found in the trials so far, and what speaks for a pause."""

    space: DesignSpace
    signals: SignalLimits
    max_in_a_row: int
    detection_limit_mv: float | None = None
    in_a_row: int = 0  # trials that were rejected, or show a faulty rig
    early_ms: float | None = None
    early: int = 0  # pulses in a row, at this ISI, that came before the impact by chance
    told: tuple[Told, ...] = ()  # the trials that count, with what their sweeps show
    emg: FloatArray | None = field(default=None, compare=False, repr=False)
    doubts: Doubts = field(default_factory=Doubts)
    paused_for: frozenset[Kind] = frozenset()  # what a person has seen: of trials that count, it is said once
    pause: Finding | None = None  # why to pause now, if at all

    def resumed(self, trials: TrialTable, paused_for: Iterable[Kind]) -> Watch:
        """The same after earlier trials; whoever resumes the session has seen their doubts and its pauses."""
        seen, told = frozenset(paused_for), told_of(trials)
        doubts = Doubts.seen(told, self.detection_limit_mv)
        return replace(self, told=told, doubts=Doubts(doubts.raised | seen), paused_for=seen)

    def seen(self) -> Watch:
        """The same after a person has seen the reason and went on."""
        seen = self.paused_for if self.pause is None else self.paused_for | {self.pause.kind}
        return replace(self, in_a_row=0, early=0, paused_for=seen, pause=None)

    def after(self, trial: Trial, answer: Sweep | Measurement) -> Watch:
        """The same after one more trial."""
        before = replace(self, doubts=self.doubts.after(()))
        if too_early_by_chance(trial, self.space):
            return _after_early(before, trial)
        found = next(findings(Evidence(trial, answer, self.signals)), None)
        if found is None or (found.severity is Severity.NOTE and found.kind in self.paused_for):
            learned = replace(before, in_a_row=0, pause=None)
        else:
            count = self.in_a_row + 1
            trials = "the last trial" if count == 1 else f"{count} trials in a row, in the last one"
            pause = replace(found, severity=Severity.PAUSE, text=f"Something was wrong in {trials}: {found.text}")
            learned = replace(before, in_a_row=count, pause=pause if count >= self.max_in_a_row else None)
        if trial.commanded_isi_ms is not None:  # a control trial says nothing about an ISI
            learned = replace(learned, early_ms=None, early=0)
        return _after_told(learned, trial, answer)


def _after_told(watch: Watch, trial: Trial, answer: Sweep | Measurement) -> Watch:
    """After a trial that may count: what is odd about it and those before."""
    if trial.mep_mv is None or not trial.told or trial.intensity_pct_rmt is not None:
        return watch
    if isinstance(answer, Sweep):
        told = told_by(answer, trial, watch.signals, watch.emg)
        watch = replace(watch, emg=answer.channels["emg"].values.copy())  # a device may fill one buffer again and again
    else:
        told = Told(trial.mep_mv, trial.isi_ms, trial.background_rms_uv)
    watch = replace(watch, told=(*watch.told, told))
    evidence = Evidence(limits=watch.signals, told=watch.told, detection_limit_mv=watch.detection_limit_mv)
    doubts = watch.doubts.after(findings(evidence))
    return replace(watch, doubts=doubts, pause=watch.pause or doubts.new)


def _after_early(watch: Watch, trial: Trial) -> Watch:
    """After a pulse that came before the impact by chance: at one ISI that does not happen for ever."""
    early = watch.early + 1 if trial.commanded_isi_ms == watch.early_ms else 1
    pause = None
    if early >= EARLY_IN_A_ROW:
        text = f"At {trial.commanded_isi_ms:g} ms the pulse came before the impact {early} times in a row"
        remedy = f"{REMEDIES[Kind.TMS_BEFORE_IMPACT]} Or begin the space at a larger ISI."
        pause = Finding(Kind.EARLY_AT_ONE_ISI, Severity.PAUSE, text, remedy)
    return replace(watch, early_ms=trial.commanded_isi_ms, early=early, pause=pause)
