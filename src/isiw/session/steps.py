"""The steps of a session, from asking to concluding a trial.

The first stimulus's own response is learnt on the way: earlier amplitudes are corrected by it, and a tap alone or a
longer ISI comes next where it may explain a window.
"""

from __future__ import annotations

import dataclasses
import itertools
import statistics
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from typing import Final

from isiw import schedule
from isiw.decision import OF_THE_WINDOW, StopDecision
from isiw.devices.protocol import Answer
from isiw.errors import DeviceTimeoutError, IsiwError, LimitExceededError, NotDelivered, error_text
from isiw.findings import Finding
from isiw.log.headers import Header
from isiw.log.new_verdicts import correction
from isiw.log.schema import Correction, Event, Intent, Waveform
from isiw.pairing.agenda import Agenda
from isiw.session.blocks import AHEAD_S, Blocks
from isiw.session.examination import WindowExamination, limit_reached
from isiw.session.intensities import set_for
from isiw.session.pausing import Pausing, paused
from isiw.session.rig import Rig
from isiw.session.sink import SessionUpdate, Sink
from isiw.session.state import Fault
from isiw.signals.judgement import judged
from isiw.signals.tap import TapResponses
from isiw.signals.watch import Watch
from isiw.strategy.decisions import stimuli_left
from isiw.strategy.strategy import Strategy
from isiw.sweeps import Measurement, Sweep
from isiw.text.sanitize import shown
from isiw.trials import Stimulus, Trial
from isiw.visit import Control

_LAST: Final = 20  # stimuli whose times say the usual pace
_FORESEEN: Final = 500  # pairs that are looked ahead to; how long more of them take follows from these
_NAP_S = 0.25  # how long a pause may go unnoticed between two stimuli

_NOTHING_GIVEN = (NotDelivered, LimitExceededError)
"""Errors that a device raises only before it delivers."""

PAIRS_FIRST: Final = 4
"""So many trials show whether a rig works, before taps alone are given."""

KNOWN: Final = "What the first stimulus alone does to the EMG is known now, and was subtracted."
LONGER: Final = "A longer ISI shows the first stimulus's own response, which may explain the enhancement so far."

LEAST_PROBABILITY: Final = 0.9
"""A window that is as probable as this should not be the first stimulus's own response."""


def pace_s(ends_s: Iterable[float]) -> float | None:
    """The usual time from one stimulus to the next [s], whatever rests are among them; None before the second one."""
    gaps_s = [after - before for before, after in itertools.pairwise(ends_s)]
    return statistics.median(gaps_s) if gaps_s else None


class OwnResponse:
    """Learns the response from each sweep, and says what should be given so that more is known of it."""

    def __init__(self, examination: WindowExamination, header: Header, taps: TapResponses) -> None:
        self._examination, self._taps = examination, taps
        self._protocol, device, self._high_ms = header.protocol, header.device, header.space.high_ms
        self._gives_taps = bool(self._protocol.taps_first) and device.tap_alone and "emg" in device.channels

    def after(self, trial: Trial, sweep: Sweep) -> Trial:
        """Learn from a sweep; its trial with the amplitude without the response, as far as that is known."""
        self._taps = self._taps.after(trial, sweep)
        return self._taps.measured(trial)

    def correct(self) -> None:
        """Correct earlier amplitudes by what is known now."""
        self._taps, others = self._taps.corrected(self._examination.trials)
        for trial in others:
            right = Correction(mep_mv=trial.mep_mv, mep_sd_mv=trial.mep_sd_mv, tap_mv=trial.tap_mv)
            self._examination.judge(partial(correction, number=trial.index, why=KNOWN, corrected=right))

    @property
    def wants_tap(self) -> bool:
        """True if a tap alone should come next."""
        trials = self._examination.trials
        if not self._gives_taps or len(trials) < PAIRS_FIRST:
            return False
        window = self._examination.learner.strategy.estimate().window
        return len(trials) < PAIRS_FIRST + self._protocol.taps_first or self._taps.wants_taps(window, trials)

    @property
    def least_isi_ms(self) -> float | None:
        """From which ISI on a pair would show the response at trials that a window rests on; None if none is needed."""
        estimate, trials = self._examination.learner.strategy.estimate(), self._examination.trials
        if (estimate.probability or 0.0) < LEAST_PROBABILITY:
            return None
        least_ms = self._taps.shown_from_ms(estimate.window, trials)
        return None if least_ms is None or least_ms > self._high_ms else least_ms

    def decided(self, decision: StopDecision) -> StopDecision:
        """A decision to stop on a window waits until an ISI has shown that it is not the response, or none is left."""
        if not decision.stop or decision.kind not in OF_THE_WINDOW or self.least_isi_ms is None:
            return decision
        strategy = self._examination.learner.strategy
        if stimuli_left(strategy.stopping, strategy.spent) == 0:
            return decision
        return decision.kind.go_on(f"It is too early to stop. {LONGER}")


class Steps:
    """Takes one step of a session after the other; each is taken once, also where the one after is interrupted."""

    def __init__(
        self,
        examination: WindowExamination,
        rig: Rig,
        sink: Sink,
        pausing: Pausing,
        watch: Watch,
        header: Header,
        backoffs_s: tuple[float, ...],
        taps: TapResponses,
    ) -> None:
        self._examination, self._rig, self._sink, self._pausing = examination, rig, sink, pausing
        self._watch, self._header, self._backoffs_s = watch, header, backoffs_s
        self._own_response = OwnResponse(examination, header, taps)
        self._at: tuple[int, bool] | None = None  # the trial that is delivered, and whether its pulse may have come
        self._agenda: Agenda | None = None
        self._blocks: Blocks | None = None
        self._ends_s, self._freely = deque[float](maxlen=_LAST + 1), rig.interrupts.freely

    def keep_to(self, blocks: Blocks) -> None:
        """What comes next is what an intervention's agenda says, block by block, and not what the strategy asks."""
        self._agenda, self._blocks = blocks.agenda, blocks

    @property
    def _strategy(self) -> Strategy:
        return self._examination.learner.strategy

    def next(self) -> StopDecision | None:
        """Conclude the trial that was delivered, or deliver the next; the decision, where there is one."""
        trial = self._examination.unconcluded
        known = self._examination.conclude(self._decision, self._known_isi_ms)
        if trial is not None and known is not None:
            self._report(trial, known.decision, known.next_isi_ms)
            return known.decision
        self._examination.require_own()
        if (decision := self.at_the_end()) is None:
            self._one_trial()
        return decision

    def at_the_end(self) -> StopDecision | None:
        """The decision to stop, by the strategy or the limits; None where there is a stimulus to deliver."""
        if (decision := self._decided()).stop:
            return decision
        if self._rig.limited.pulses_left:
            return None
        decision = limit_reached(self._header.limits.max_pulses, self._header.given_before)
        self._examination.event("limit", decision.reason)
        self._examination.log_estimate(lambda: decision)
        return decision

    def log_estimate(self) -> None:
        """Log what is known after the last trial, which a session that ended then may not have corrected others by."""
        self._own_response.correct()
        if self._examination.conclude(self._decision, self._known_isi_ms) is None:
            self._examination.log_estimate(self._decision, self._known_isi_ms)

    def last_pair_came(self, ago_s: float | None) -> None:
        """The last pair of an intervention that is resumed was delivered so long ago [s]; None if it was not yet."""
        if self._blocks is not None and ago_s is not None and self._agenda is not None:
            self._blocks.came(self._agenda.plan.last_pair, ago_s)

    def fault_of(self, error: BaseException) -> Fault:
        """What an error that ends the session was, and in which trial."""
        got = f" ({shown(error.got)})" if isinstance(error, IsiwError) and error.got is not None else ""
        what = f"{error.what}{got}" if isinstance(error, IsiwError) else error_text(error)
        return Fault(what) if self._at is None else Fault(what, *self._at)

    def seen(self) -> None:
        """A person has seen the reason of a pause, and the session goes on."""
        self._watch = self._watch.seen()

    def _report(self, trial: Trial, decision: StopDecision, next_isi_ms: float | None) -> None:
        """Tell the sink that a trial is concluded, and pause where a person should look at the data first."""
        if not decision.stop and (pause := self._watch.pause) is not None:
            self._pausing.reason, self._pausing.kind = f"{pause}", pause.kind
        left = self._stimuli_left()
        estimate = self._strategy.estimate()
        update = SessionUpdate(trial, estimate, decision, next_isi_ms, left, self._left_s(left))
        self._freely(self._sink.updated, update)

    def _left_s(self, left: int) -> float | None:
        """About how long so many pairs take [s], with the rests and control trials between them."""
        protocol, seed, usual_s = self._header.protocol, self._header.seed, pace_s(self._ends_s)
        if usual_s is None or self._agenda is not None:
            return None
        intervals_s: list[float] = []
        first, pairs = len(self._examination.trials), 0
        while pairs < min(left, _FORESEEN) and len(intervals_s) < self._rig.limited.pulses_left:
            number = first + len(intervals_s)
            intervals_s.append(max(usual_s, protocol.rest_s) if schedule.rests_before(protocol, number) else usual_s)
            pairs += schedule.control(protocol, number, seed) is None
        return self._rig.limited.ahead_s(intervals_s) * (left / pairs if pairs == _FORESEEN else 1)

    def _decision(self) -> StopDecision:
        """The strategy's decision; none is made on data that a person should look at first."""
        pause = self._watch.pause
        if pause is not None and self._stimuli_left():
            return paused(f"{pause}")
        return self._decided()

    def _decided(self) -> StopDecision:
        if self._agenda is not None:
            return self._agenda.decision(len(self._examination.trials))
        return self._own_response.decided(self._freely(self._strategy.decision))

    def _stimuli_left(self) -> int:
        if self._agenda is not None:
            return min(self._agenda.left(len(self._examination.trials)), self._rig.limited.pulses_left)
        budget = stimuli_left(self._strategy.stopping, self._strategy.spent)
        return self._rig.limited.pulses_left if budget is None else min(budget, self._rig.limited.pulses_left)

    def _one_trial(self) -> None:
        """Ask and deliver; what was refused before firing is tried again."""
        number = len(self._examination.trials)
        if self._blocks is not None and not self._announced(self._blocks, number):
            return None
        control = self._next_control  # looked at once: a verdict may come at any time, and change it
        isi_ms, is_tap = self._next_isi_ms(control), control is Control.TAP_ALONE
        stimulus = Stimulus(number, isi_ms, is_tap, set_for(control, self._strategy, self._header))
        for backoff_s in self._backoffs_s:
            try:
                return self._deliver_in_time(stimulus)
            except NotDelivered:
                if self._pausing.due:
                    raise
                self._freely(self._rig.clock.sleep_s, backoff_s)
        return self._deliver_in_time(stimulus)

    def _announced(self, blocks: Blocks, number: int) -> bool:
        """Tell the operator what comes; False if that pauses the session first, or somebody has another wish."""
        if blocks.left_s(number) > AHEAD_S:  # nothing is armed as long as nothing comes
            self._rig.disarm()
        self._freely(self._until_due, blocks, number, AHEAD_S)
        if self._disturbed:
            return False
        if (said := blocks.announcement(number)) is not None:
            self._pausing.reason, self._pausing.kind = said, None
            blocks.said(number)
            return False
        if not self._rig.is_armed:
            self._rig.stage()
        self._freely(self._until_due, blocks, number, 0.0)
        return not self._disturbed

    @property
    def _next_control(self) -> Control | None:
        if self._agenda is not None:
            return self._agenda.control(len(self._examination.trials))
        if self._own_response.wants_tap:
            return Control.TAP_ALONE
        return schedule.control(self._header.protocol, len(self._examination.trials), self._header.seed)

    def _next_isi_ms(self, control: Control | None) -> float | None:
        """The next ISI [ms]; None if a control trial comes next."""
        if control:
            return None
        if self._agenda is not None:
            return float(self._freely(self._agenda.isi_ms, self._examination.trials))
        isi_ms: float = self._freely(self._strategy.ask, self._header.ask_deadline_s)
        least_ms = self._own_response.least_isi_ms
        return isi_ms if least_ms is None or isi_ms >= least_ms else self._strategy.ask_longer(least_ms, LONGER)

    def _known_isi_ms(self) -> float | None:
        """The same for those who look on; None if it is to stay concealed."""
        intervention = self._header.intervention
        hidden = intervention is not None and intervention.hides(len(self._examination.trials))
        return None if hidden else self._next_isi_ms(self._next_control)

    def _deliver_in_time(self, stimulus: Stimulus) -> None:
        self._freely(self._wait)
        if not self._disturbed:
            fallback = None if stimulus.isi_ms is None else self._strategy.fallback_reason
            self._deliver(stimulus, fallback)
            self._ends_s.append(self._rig.clock.now_s())

    def _wait(self) -> None:
        """Sleep until limits and protocol allow the next stimulus, or an operator has another wish."""
        number = len(self._examination.trials)
        if self._agenda is not None:
            rests, interval_s = self._agenda.rests_before(number), self._agenda.interval_s(number)
        else:
            rests = schedule.rests_before(self._header.protocol, number)
            interval_s = schedule.interval_s(self._header.protocol, number, self._header.seed)
        text = f"Rest after {number} trials" if rests else "Next stimulus"
        self._sleep(lambda: self._rig.limited.wait_s(interval_s), text, rests=rests)

    def _until_due(self, blocks: Blocks, number: int, ahead_s: float) -> None:
        """Sleep until so long [s] before a trial's block is due, or an operator has another wish."""
        self._sleep(lambda: blocks.left_s(number, ahead_s), "Until the next block is due", rests=True, more_s=ahead_s)

    def _sleep(self, left_s: Callable[[], float], text: str, *, rests: bool, more_s: float = 0.0) -> None:
        """Sleep as long as time is left [s], in naps; who looks on hears what for, and that so much more follows."""
        try:
            while not self._disturbed and (wait_s := left_s()) > 0:
                self._sink.waiting(wait_s + more_s, text, rests=rests)
                self._rig.clock.sleep_s(min(wait_s, _NAP_S))
        finally:
            self._sink.waiting(None)

    @property
    def _disturbed(self) -> bool:
        return self._pausing.reason is not None or self._examination.overruled

    def _deliver(self, stimulus: Stimulus, fallback: str | None) -> None:
        """Deliver a pair of stimuli or a control trial, unless a trial was judged since it was asked for."""
        self._at = stimulus.trial, False
        try:
            self._freely(self._rig.limited.check, stimulus)  # before anything is logged of it
        except NotDelivered as error:
            self._examination.log_refusal("limit", error)
            raise
        self._begin_block(stimulus.trial)
        if not self._examination.intend(Intent.of(stimulus, self._rig.clock.now_s()), fallback):
            return
        if self._blocks is not None:
            self._blocks.came(stimulus.trial)
        trial: Trial | None = None
        doubt: Finding | None = None
        try:
            self._sink.log.require_in_place()
            # From here on it may have been given, whatever fails.
            trial = self._with_intensity(Trial.unknown(stimulus), stimulus)
            self._at = stimulus.trial, True
            answer = self._answer(stimulus)
            trial = self._with_intensity(judged(answer, stimulus, self._header.space, self._header.signals), stimulus)
            if isinstance(answer, Sweep):
                trial = self._own_response.after(trial, answer)
            self._watch = self._watch.after(trial, answer)
            doubt = self._watch.doubts.new
        except Exception as error:
            if trial is None or isinstance(error, _NOTHING_GIVEN):
                trial, self._at = None, (stimulus.trial, False)
                self._examination.log_refusal("refused", error, stimulus.trial)
                raise
            if not self._pausing.due:
                raise
            self._sink.faults.append(f"While the device was being disarmed: {error_text(error)}")
        finally:
            if trial is not None:
                self._examination.came(trial)
                if doubt is not None:
                    self._examination.event("doubt", f"{doubt}", finding=doubt.kind)
                self._own_response.correct()
            self._examination.log_faults()
            self._sink.log.sync()
        self._at = None

    def _begin_block(self, number: int) -> None:
        """Log where a block begins; the intent behind it puts that on disk."""
        if self._blocks is not None and (begun := self._blocks.begun(number)) is not None:
            self._sink.append(begun)
            self._sink.say(begun.text)

    def _answer(self, stimulus: Stimulus) -> Answer:
        """The answer to a stimulus; its waveforms are logged, also if it comes too late."""
        try:
            answer = self._rig.limited.deliver(stimulus, self._header.timeout_s)
        except DeviceTimeoutError:
            late = self._rig.late_answer()
            if late is not None:
                self._log_waveforms(stimulus, late)
                seen = f"{late.mep_mv:g} mV" if isinstance(late, Measurement) else "a sweep"
                text = f"An answer came after the deadline: {seen}. It is in the log, but is not used."
                self._sink.append(Event(kind="late", trial=stimulus.trial, text=text))
            raise
        self._log_waveforms(stimulus, answer)
        return answer

    def _log_waveforms(self, stimulus: Stimulus, answer: Answer) -> None:
        if isinstance(answer, Sweep):
            for name, channel in answer.channels.items():
                self._sink.append(Waveform.of(stimulus.trial, channel), name)

    def _with_intensity(self, trial: Trial, stimulus: Stimulus) -> Trial:
        """A trial with the intensity of its pulse, the plan's or the one to be set; none where it is the usual one."""
        slot = None if self._agenda is None else self._agenda.slot(trial.index)
        planned = None if slot is None else slot.intensity_pct_rmt
        if stimulus.intensity_pct_rmt is not None:
            usual = self._header.visit.intensity_pct_rmt
            planned = None if stimulus.intensity_pct_rmt == usual else stimulus.intensity_pct_rmt
        return trial if trial.intensity_pct_rmt == planned else dataclasses.replace(trial, intensity_pct_rmt=planned)
