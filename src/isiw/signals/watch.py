"""Looks at each trial and the amplitudes so far for what is wrong, and says when a person should look at it.

A finding in one trial counts only after several in a row; each kind of doubt about several trials is raised once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Final

from isiw.design import DesignSpace
from isiw.findings import REMEDIES, Finding, Kind, Severity
from isiw.signals import places, rig
from isiw.signals.amplitudes import Counted, Doubts, counted_of, odd_amplitudes
from isiw.signals.limits import SignalLimits
from isiw.signals.places import shown_by
from isiw.signals.rig import Evidence, too_early_by_chance
from isiw.sweeps import Measurement, Sweep
from isiw.trials import Trial, TrialTable
from isiw.types import FloatArray

OF_SWEEP: Final = (rig.unusable_emg, rig.wrong_acceleration, rig.no_origin, rig.double_pulse, rig.stray_edge)
"""Checks of the last trial and its sweep, the surest first: the first finding explains the others."""

OF_TRIAL: Final = (rig.wrong_level, rig.lost_trial)
"""Checks of the last trial, be there a sweep or not."""

OF_SWEEPS: Final = (places.hum, places.drift, places.misplaced, places.cut_off, places.artefact, places.decay)
"""Checks of what the sweeps of the trials that count so far show."""


def findings(evidence: Evidence) -> Iterator[Finding]:
    """What is found in some evidence, in the order of the checks."""
    trial, answer = evidence.trial, evidence.answer
    if trial is not None and isinstance(answer, Sweep):
        yield from filter(None, (find(answer, trial) for find in OF_SWEEP))
    if trial is not None:
        yield from filter(None, (find(trial, evidence) for find in OF_TRIAL))
    if evidence.told:
        yield from filter(None, [places.repeated(evidence)])
        yield from odd_amplitudes(evidence.told, evidence.detection_limit_mv)
        yield from filter(None, (find(evidence) for find in OF_SWEEPS))


EARLY_IN_A_ROW: Final = 9
"""By chance a pulse is early at one ISI a few times in a row; after three, strategies that may choose ask elsewhere."""


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
    told: tuple[Counted, ...] = ()  # the trials that count, with what their sweeps show
    emg: FloatArray | None = field(default=None, compare=False, repr=False)
    doubts: Doubts = field(default_factory=Doubts)
    paused_for: frozenset[Kind] = frozenset()  # what a person has seen: of trials that count, it is said once
    pause: Finding | None = None  # why to pause now, if at all

    def resumed(self, trials: TrialTable, paused_for: Iterable[Kind]) -> Watch:
        """The same after earlier trials; whoever resumes the session has seen their doubts and its pauses."""
        seen, told = frozenset(paused_for), counted_of(trials)
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
        return _after_counted(learned, trial, answer)


def _after_counted(watch: Watch, trial: Trial, answer: Sweep | Measurement) -> Watch:
    """After a trial that may count: what is odd about it and those before."""
    if trial.mep_mv is None or not trial.told or trial.intensity_pct_rmt is not None:
        return watch
    if isinstance(answer, Sweep):
        told = shown_by(answer, trial, watch.signals, watch.emg)
        watch = replace(watch, emg=answer.channels["emg"].values.copy())  # a device may fill one buffer again and again
    else:
        told = Counted(trial.mep_mv, trial.isi_ms, trial.background_rms_uv)
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
