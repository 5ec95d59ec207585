"""Looks at each trial for what is wrong, and says when a session should pause so that a person looks.

A finding in one trial counts only after several in a row; each kind of doubt about several trials is raised once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Final

from isiw.design import DesignSpace
from isiw.findings import Finding, Kind, Severity
from isiw.signals import places, rig
from isiw.signals.evidence import (
    Check,
    Evidence,
    Told,
    equal,
    large,
    of_sweep,
    of_told,
    of_trial,
    silent,
    small,
    stopped,
    told_of,
)
from isiw.signals.limits import SignalLimits
from isiw.signals.places import told_by
from isiw.signals.rig import remedy_for, too_early_by_chance
from isiw.trials import Measurement, Sweep, Trial, TrialTable
from isiw.types import FloatArray

CHECKS: Final[tuple[Check, ...]] = (
    of_sweep(rig.unusable_emg),
    of_sweep(rig.wrong_acceleration),
    of_sweep(rig.no_origin),
    of_sweep(rig.double_pulse),
    of_sweep(rig.stray_edge),
    of_trial(rig.wrong_level),
    of_trial(rig.lost_trial),
    of_told(places.repeated),
    of_told(equal),
    of_told(silent),
    of_told(stopped),
    of_told(small),
    of_told(large),
    of_told(places.hum),
    of_told(places.drift),
    of_told(places.misplaced),
    of_told(places.cut_off),
    of_told(places.artefact),
    of_told(places.decay),
)
"""The surest first: of one trial, the first finding explains the others."""


def findings(evidence: Evidence) -> Iterator[Finding]:
    """What is found in some evidence, in the order of the list."""
    found = (check(evidence) for check in CHECKS)
    return (finding for finding in found if finding is not None)


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
    """What was found in the trials so far, and what speaks for a pause.

    `paused_for` are the kinds that a person has seen in a pause: of trials that count, the same is said once. `pause`
    is why to pause now, if at all; trials that `told` something are kept with what their sweeps show.
    """

    space: DesignSpace
    signals: SignalLimits
    max_in_a_row: int
    detection_limit_mv: float | None = None
    in_a_row: int = 0  # trials that were rejected, or show a faulty rig
    early_ms: float | None = None
    early: int = 0  # pulses in a row, at this ISI, that came before the impact by chance
    told: tuple[Told, ...] = ()
    emg: FloatArray | None = field(default=None, compare=False, repr=False)
    doubts: Doubts = field(default_factory=Doubts)
    paused_for: frozenset[Kind] = frozenset()
    pause: Finding | None = None

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
            pause = _pause(found, count) if count >= self.max_in_a_row else None
            learned = replace(before, in_a_row=count, pause=pause)
        if trial.commanded_isi_ms is not None:  # a control trial says nothing about an ISI
            learned = replace(learned, early_ms=None, early=0)
        return _after_told(learned, trial, answer)


def _pause(found: Finding, count: int) -> Finding:
    trials = "the last trial" if count == 1 else f"{count} trials in a row, in the last one"
    return replace(found, severity=Severity.PAUSE, text=f"Something was wrong in {trials}: {found.text}")


def _after_told(watch: Watch, trial: Trial, answer: Sweep | Measurement) -> Watch:
    """After a trial that may count: what is odd about it and those before."""
    if trial.mep_mv is None or not trial.told:
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
        remedy = f"{remedy_for(Kind.TMS_BEFORE_IMPACT)} Or begin the space at a larger ISI."
        pause = Finding(Kind.EARLY_AT_ONE_ISI, Severity.PAUSE, text, remedy)
    return replace(watch, early_ms=trial.commanded_isi_ms, early=early, pause=pause)
