"""Whether a session should pause and let a person look: trials rejected in a row, and data that look like a slip."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.devices.protocol import Answer
from isiw.signals.doubts import REPEATED, Doubt, Doubts, doubt_of, doubts_of
from isiw.signals.faults import Fault, likely_fault, remedy_for, too_early_by_chance
from isiw.signals.limits import SignalLimits
from isiw.signals.misplaced import (
    Misplaced,
    doubt_of_artefact,
    doubt_of_place,
    is_artefact,
    kinds_asked,
    misplaced_after,
)
from isiw.trials import MistrialReason, Sweep, Trial, TrialTable
from isiw.types import FloatArray

__all__ = ["Watch"]

EARLY_IN_A_ROW: Final = 9
"""By chance a pulse is early at one ISI a few times in a row; after three, strategies that may choose ask elsewhere."""


@dataclass(frozen=True)
class Watch:
    """What speaks for a pause after the trials so far.

    Args:
        space: the session's design space.
        signals: what its sweeps are judged by.
        max_in_a_row: how many trials in a row may be rejected, or show a faulty rig.
        detection_limit_mv: what an amplitude of 0 is known to be below [mV]; None where nobody has said.
        in_a_row: how many there have been.
        early_ms: the ISI at which pulses came before the impact by chance [ms].
        early: how many in a row there.
        meps_mv: the amplitudes told [mV].
        isis_ms: the ISIs of the same trials [ms]; None for TMS alone.
        misplaced: responses outside the MEP window, since the last one within it.
        artefacts: how many trials in a row had an artefact in it.
        emg: samples of the last sweep; None where there are none.
        doubts: which doubts about the amplitudes were raised, and which the last trial raised.
        seen_reasons: why it paused before, as a person has seen; of trials that count, the same fault is said once.
        reason: why to pause now, and what to do; None where there is no reason.
    """

    space: DesignSpace
    signals: SignalLimits
    max_in_a_row: int
    detection_limit_mv: float | None = None
    in_a_row: int = 0
    early_ms: float | None = None
    early: int = 0
    meps_mv: tuple[float, ...] = ()
    isis_ms: tuple[float | None, ...] = ()
    misplaced: tuple[Misplaced, ...] = ()
    artefacts: int = 0
    emg: FloatArray | None = field(default=None, compare=False, repr=False)
    doubts: Doubts = field(default_factory=Doubts)
    seen_reasons: frozenset[str] = frozenset()
    reason: str | None = None

    def resumed(self, trials: TrialTable, reasons: Iterable[str]) -> Watch:
        """The same after earlier trials; whoever resumes the session has seen their doubts and its pauses.

        Args:
            trials: what was delivered before.
            reasons: why it paused.
        """
        meps_mv, isis_ms = trials.amplitudes
        seen, doubts = frozenset(reasons), doubts_of(meps_mv, self.detection_limit_mv, isis_ms)
        doubts = replace(doubts, raised=doubts.raised | kinds_asked(seen))  # those that no amplitude shows
        return replace(self, meps_mv=meps_mv, isis_ms=isis_ms, doubts=doubts, seen_reasons=seen)

    def seen(self) -> Watch:
        """The same after a person has seen the reason and went on."""
        seen = self.seen_reasons if self.reason is None else self.seen_reasons | {self.reason}
        return replace(self, in_a_row=0, early=0, seen_reasons=seen, reason=None)

    def after(self, trial: Trial, answer: Answer) -> Watch:
        """The same after one more trial.

        Args:
            trial: the trial.
            answer: what the device answered.
        """
        before = replace(self, doubts=self.doubts.after())
        if too_early_by_chance(trial, self.space):
            return _after_early(before, trial)
        fault = likely_fault(answer, trial, self.signals)
        if fault is None or (trial.reason is None and any(fault.remedy in seen for seen in self.seen_reasons)):
            learned = replace(before, in_a_row=0, reason=None)
        else:
            count = self.in_a_row + 1
            learned = replace(
                before, in_a_row=count, reason=_said(fault, count) if count >= self.max_in_a_row else None
            )
        if trial.commanded_isi_ms is not None:  # a control trial says nothing about an ISI
            learned = replace(learned, early_ms=None, early=0)
        if trial.mep_mv is None or not trial.told:
            return learned
        repeated = None
        if isinstance(answer, Sweep):
            emg, before_emg = answer.channels["emg"].values, learned.emg
            repeated = None if before_emg is None or not np.array_equal(emg, before_emg) else REPEATED
            learned = replace(
                learned,
                misplaced=misplaced_after(learned.misplaced, answer, trial, self.signals),
                artefacts=learned.artefacts + 1 if is_artefact(answer, trial, self.signals) else 0,
                emg=emg.copy(),  # a device may fill one buffer again and again
            )
        return _with_amplitude(learned, trial.mep_mv, trial.isi_ms, repeated)


def _said(fault: Fault, count: int) -> str:
    if count == 1:
        return f"Something was wrong in the last trial: {fault}"
    return f"Something was wrong in {count} trials in a row, in the last one: {fault}"


def _with_amplitude(watch: Watch, mep_mv: float, isi_ms: float | None, repeated: Doubt | None) -> Watch:
    watch = replace(watch, meps_mv=(*watch.meps_mv, mep_mv), isis_ms=(*watch.isis_ms, isi_ms))
    odd = doubt_of(watch.meps_mv, watch.detection_limit_mv, watch.isis_ms)
    artefact = doubt_of_artefact(watch.artefacts, watch.signals)
    doubts = watch.doubts.after(repeated, odd, doubt_of_place(watch.misplaced, watch.signals), artefact)
    reason = watch.reason or (None if doubts.new is None else doubts.new.text)
    return replace(watch, doubts=doubts, reason=reason)


def _after_early(watch: Watch, trial: Trial) -> Watch:
    """After a pulse that came before the impact by chance: at one ISI that does not happen for ever."""
    early = watch.early + 1 if trial.commanded_isi_ms == watch.early_ms else 1
    reason = None
    if early >= EARLY_IN_A_ROW:
        reason = (
            f"At {trial.commanded_isi_ms:g} ms the pulse came before the impact {early} times in a row. "
            f"{remedy_for(MistrialReason.TMS_BEFORE_IMPACT)} Or begin the space at a larger ISI."
        )
    return replace(watch, early_ms=trial.commanded_isi_ms, early=early, reason=reason)
