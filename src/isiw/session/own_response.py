"""The first stimulus's own response: a session learns it, corrects amplitudes, and says what would show more of it."""

from __future__ import annotations

from functools import partial
from typing import Final

from isiw.decision import OF_THE_WINDOW, StopDecision
from isiw.log.headers import Header
from isiw.log.new_verdicts import correction
from isiw.log.schema import Correction
from isiw.session.examination import WindowExamination
from isiw.signals.tap import TapResponses
from isiw.strategy.decisions import stimuli_left
from isiw.sweeps import Sweep
from isiw.trials import Trial

PAIRS_FIRST: Final = 4
"""So many trials show whether a rig works, before taps alone are given."""

KNOWN: Final = "What the first stimulus alone does to the EMG is known now, and was subtracted."
LONGER: Final = "A longer ISI shows the first stimulus's own response, which may explain the enhancement so far."

LEAST_PROBABILITY: Final = 0.9
"""A window that is as probable as this should not be the first stimulus's own response."""


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
