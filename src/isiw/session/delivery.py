"""One delivery: the intent on disk before it, the trial after it, whatever the device does."""

from __future__ import annotations

from dataclasses import dataclass

from isiw.design import DesignSpace
from isiw.devices.protocol import Answer
from isiw.errors import DeviceError, DeviceTimeoutError, LimitExceededError, NotDelivered, told
from isiw.log.schema import Event
from isiw.session.journal import Journal
from isiw.session.pausing import Pausing
from isiw.session.rig import Rig
from isiw.signals.judgement import judge, judge_measurement
from isiw.signals.limits import SignalLimits
from isiw.signals.watch import Watch
from isiw.text.shown import shown
from isiw.trials import Measurement, Stimulus, Sweep, Trial

__all__ = ["Delivery"]

_NOTHING_GIVEN = (NotDelivered, LimitExceededError)
"""What a device raises only before it delivers."""


@dataclass
class Delivery:
    """Delivers stimuli, judges what came of them, and watches whether it makes sense.

    Args:
        rig: delivers.
        journal: where it is written.
        pausing: whether a failure comes of being disarmed for a pause.
        watch: finds what is wrong with a trial, and what speaks for a pause.
        space: what the ISIs are judged by.
        signals: what the sweeps are judged by.
        timeout_s: how long the device may take [s].
    """

    rig: Rig
    journal: Journal
    pausing: Pausing
    watch: Watch
    space: DesignSpace
    signals: SignalLimits
    timeout_s: float

    def deliver(self, stimulus: Stimulus, fallback: str | None) -> None:
        """Deliver a pair of stimuli or a control trial, unless a trial was judged anew since it was asked for.

        Args:
            stimulus: what to deliver.
            fallback: why its ISI is not the acquisition function's choice; None where it is.

        Raises:
            NotDelivered: refused before firing.
            LimitExceededError: beyond the limits; nothing was delivered.
            LogError: the log is not where it was; nothing was delivered.
            DeviceError: the device failed; the trial is a mistrial "outcome unknown".
        """
        self._require_allowed(stimulus)
        if not self.journal.intent(stimulus, self.rig.clock.now_s(), fallback):
            return
        trial: Trial | None = None
        try:
            self.journal.log.require_in_place()
            trial = Trial.unknown(stimulus)  # from here on it may have been given, whatever fails
            answer = self._answer(stimulus)
            trial = self._judged(stimulus, answer)
            self.watch = self.watch.after(trial, answer)
        except Exception as error:
            if trial is None or isinstance(error, _NOTHING_GIVEN):
                trial = None
                self.journal.refusal("refused", error, stimulus.trial)
                raise
            if not self.pausing.due:
                raise
            self.rig.faults.append(f"While the device was being disarmed: {told(error)}")
        finally:
            if trial is not None:
                self.journal.trial(trial)
            self.journal.faults(self.rig.faults)
            self.journal.log.sync()

    def _require_allowed(self, stimulus: Stimulus) -> None:
        """Raise where the limits or the device do not allow a stimulus, before anything is logged of it."""
        try:
            self.rig.check(stimulus)
        except NotDelivered as error:
            self.journal.refusal("limit", error)
            raise

    def _answer(self, stimulus: Stimulus) -> Answer:
        """What came of a stimulus; its waveforms are logged, also where it comes too late."""
        try:
            answer = self.rig.deliver(stimulus, self.timeout_s)
        except DeviceTimeoutError:
            late = self.rig.late_answer()
            if late is not None:
                self.journal.waveforms(stimulus, late)
                self.journal.log.append(Event(kind="late", trial=stimulus.trial, text=_late_text(late)))
            raise
        self.journal.waveforms(stimulus, answer)
        return answer

    def _judged(self, stimulus: Stimulus, answer: Answer) -> Trial:
        if isinstance(answer, Sweep):
            return judge(answer, stimulus, self.space, self.signals)
        if isinstance(answer, Measurement):
            return judge_measurement(answer, stimulus, self.space, self.signals)
        raise DeviceError(
            f"the device's deliver returned {shown(answer)}",
            expected="an isiw.Sweep or an isiw.Measurement",
            remedy="Let it return what it recorded, or the MEP that it measured: isiw.Measurement(mep_mv, isi_ms).",
        )


def _late_text(answer: Answer) -> str:
    what = f"{answer.mep_mv:g} mV" if isinstance(answer, Measurement) else "a sweep"
    return f"An answer came after the deadline: {what}. It is in the log, but is not used."
