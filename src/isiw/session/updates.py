"""What a session reports: after every trial, and at its end."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from isiw.estimate import WindowEstimate
from isiw.strategy.stopping import StopDecision
from isiw.trials import Trial, TrialTable


@dataclass(frozen=True)
class SessionUpdate:
    """What is known after one trial.

    Args:
        trial: the trial.
        estimate: what is believed about the window.
        decision: whether the session stops here, and why.
        next_isi_ms: what is asked next [ms]; None where the session stops, or a control trial comes next.
        stimuli_left: how many stimuli the budget and the limits still allow.
        left_s: about how long so many take at the pace of the last ones [s]; None where there is no pace yet.
    """

    trial: Trial
    estimate: WindowEstimate
    decision: StopDecision
    next_isi_ms: float | None
    stimuli_left: int
    left_s: float | None = None


@dataclass(frozen=True)
class SessionResult:
    """How a session ended.

    Args:
        estimate: what is believed about the window.
        decision: why it ended.
        trials: all its trials.
        log: its log.
    """

    estimate: WindowEstimate
    decision: StopDecision
    trials: TrialTable
    log: Path

    def __str__(self) -> str:
        return f"{self.estimate}\nTrials: {self.trials}\nEnded: {self.decision.reason}\nLog: {self.log}"
