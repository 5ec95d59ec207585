"""A session's trials and the log that they are in: what is added to the one is added to the other."""

from __future__ import annotations

from collections import deque

from isiw.devices.protocol import Answer
from isiw.errors import LimitExceededError, told
from isiw.log.schema import Event, EventKind, Waveform
from isiw.log.writer import LogWriter
from isiw.strategy.strategy import Strategy
from isiw.trials import Stimulus, Sweep, Trial, TrialTable

__all__ = ["Journal", "learn"]


def learn(strategy: Strategy, trial: Trial) -> None:
    """Tell a strategy one trial, or count it where there is nothing to tell.

    Args:
        strategy: the strategy.
        trial: the trial.
    """
    if trial.told:
        strategy.learn(trial.isi_ms, trial.mep_mv, isi_sd_ms=trial.isi_sd_ms)
    else:
        strategy.count_mistrial()


class Journal:
    """The trials so far, and the log that they are written to once it is open.

    Args:
        trials: what was delivered before.
    """

    log: LogWriter

    def __init__(self, trials: TrialTable | None = None) -> None:
        self.trials = trials or TrialTable()
        self.unconcluded: Trial | None = None

    @property
    def last(self) -> int | None:
        """The number of the last trial; None before the first."""
        return len(self.trials) - 1 if self.trials else None

    def event(self, kind: EventKind, text: str) -> None:
        """Write that something happened, behind the last trial.

        Args:
            kind: what kind of thing.
            text: what, in words.
        """
        self.log.append(Event(kind=kind, trial=self.last, text=text))

    def faults(self, faults: deque[str]) -> None:
        """Write what went wrong and was overcome, in whichever thread."""
        while faults:
            self.event("fault", faults.popleft())

    def failure(self, error: BaseException) -> None:
        """Write what ends a session before its time."""
        kind: EventKind = "limit" if isinstance(error, LimitExceededError) else "fault"
        self.event(kind, "Interrupted by the operator." if isinstance(error, KeyboardInterrupt) else told(error))

    def waveforms(self, stimulus: Stimulus, answer: Answer) -> None:
        """Write what was recorded, where waveforms were.

        Args:
            stimulus: what was delivered.
            answer: what came of it.
        """
        if isinstance(answer, Sweep):
            for name, channel in answer.channels.items():
                self.log.append(Waveform.of(stimulus.trial, channel), name)

    def trial(self, trial: Trial) -> None:
        """Write a trial; it is unconcluded until it is learnt and an estimate is written."""
        self.log.append(trial)
        self.trials = self.trials.appended(trial)
        self.unconcluded = trial
