"""Stopping rules: frozen settings that compose with `AnyOf`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final

from isiw.checks import Checked, Count, Positive, Share, number
from isiw.decision import OF_THE_WINDOW, StopDecision, StopKind
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.models.protocol import GIVEN_COUNTS
from isiw.strategy.decisions import Progress, StoppingRule, looks_back, stimuli_left
from isiw.summary import SURE
from isiw.text.sanitize import counted

MOST_BY_TIME: Final = 0.05
"""No session stops on a window while changes with time explain it all with more probability than this."""


def _stop_unless_by_time(kind: StopKind, estimate: WindowEstimate, reason: str) -> StopDecision:
    """The decision to stop, unless time alone may explain a window."""
    if estimate.time_alone is None or estimate.time_alone <= MOST_BY_TIME:
        return kind.stop(reason)
    return kind.go_on(
        "It is too early to stop: that amplitudes have changed with time, and there is no window, has probability "
        f"{estimate.time_alone:.2f}."
    )


@dataclass(frozen=True)
class Budget(Checked):
    """Stop when `max_trials` stimuli have been delivered; as the settings of a strategy, it stops by this alone.

    Args:
        max_trials: stop after this many stimuli; mistrials count, control trials do not.
    """

    max_trials: Count

    def rule(self, initial: int) -> Budget:  # noqa: ARG002 - the budget counts from the first stimulus
        """The budget used up."""
        return self

    def stimuli_left(self, delivered: int) -> int:
        """Number of stimuli that are left after so many; see `HasBudget`."""
        return max(0, self.max_trials - delivered)

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether to stop."""
        left = self.max_trials - progress.delivered
        if left <= 0:
            return StopKind.BUDGET.stop(f"The budget of {counted(self.max_trials, 'stimulus', 'stimuli')} is used up.")
        are_left = counted(left, "stimulus is left", "stimuli are left")
        return StopKind.BUDGET.go_on(f"{are_left} of the budget of {self.max_trials}.")  # limits may allow fewer


@dataclass(frozen=True)
class CredibleWidth(Checked):
    """Stop when the credible intervals of both edges are narrow enough, and a window is likely.

    If the model weighs hypotheses, the intervals must be narrow and agree under each of at least `min_share`: sessions
    that stop early do so on the hypothesis that promises most (decision 10).
    """

    width_ms: Positive
    level: Annotated[float, partial(number, above=0, below=1)] = 0.9
    min_probability: Share = 0.9
    min_share: Share = 0.02

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether to stop."""
        if progress.estimate.too_little is not None:
            return StopKind.TOO_LITTLE.go_on(progress.estimate.too_little)
        intervals = progress.estimate.robust_interval(self.level, self.min_share)
        if intervals is None:
            return StopKind.KNOWN.go_on("The edges have no credible intervals.")
        # An edge that lies beyond the range for certain is an answer: its interval has no width.
        widths = [0.0 if low == high else high - low for low, high in intervals]
        probability = progress.estimate.probability or 0.0
        start, end = (f"known to {x:.0f} ms" if math.isfinite(x) else "still unknown" for x in widths)
        end = end.removeprefix("known ") if all(map(math.isfinite, widths)) else end
        edges = f"start {start}, end {end} ({100 * self.level:.0f} % intervals)"
        if max(widths) > self.width_ms:
            ends = f"The session ends when both edges of the window are known to {self.width_ms:g} ms"
            return StopKind.KNOWN.go_on(f"{ends}; {edges}.")
        if probability < self.min_probability:
            needed = f"{probability:.2f}, and {self.min_probability:g} is needed"
            return StopKind.KNOWN.go_on(f"The window is not probable enough yet ({needed}): {edges}.")
        return _stop_unless_by_time(StopKind.KNOWN, progress.estimate, f"The window is known: {edges}.")


@dataclass(frozen=True)
class NoWindow(Checked):
    """Stop when "no window" is at least this probable."""

    probability: Annotated[float, partial(number, above=0, most=1)] = 0.9

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether to stop."""
        if progress.estimate.probability is None:
            return StopKind.ABSENT.go_on("The probability of a window is not known.")
        if progress.estimate.too_little is not None:
            return StopKind.TOO_LITTLE.go_on(progress.estimate.too_little)
        absent = 1.0 - progress.estimate.probability
        if absent >= self.probability:
            there_is = "There is no window" if absent >= SURE else "There is probably no window"
            return StopKind.ABSENT.stop(f"{there_is}, with probability {absent:.2f}.")
        return StopKind.ABSENT.go_on(f"The probability that there is no window is {absent:.2f}.")


@dataclass(frozen=True)
class ExpectedF1(Checked):
    """Stop at this expected F1 of a probable window; never at 1, as finitely many samples may all agree on one."""

    f1: Share = 0.9
    min_probability: Share = 0.9

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether to stop."""
        estimate = progress.estimate
        if estimate.expected_f1 is None or estimate.probability is None:
            return StopKind.KNOWN.go_on("The F1 to be expected is not known.")
        if estimate.too_little is not None:
            return StopKind.TOO_LITTLE.go_on(estimate.too_little)
        floored = math.floor(100 * estimate.expected_f1 + 1e-9) / 100  # so that nothing is said that is not reached
        least = f"is at least {floored:.2f}"
        if self.f1 < 1.0 and estimate.expected_f1 >= self.f1 and estimate.probability >= self.min_probability:
            return _stop_unless_by_time(StopKind.KNOWN, estimate, f"The window is known: its expected F1 {least}.")
        ends = f"; {self.f1:g} ends the session" if self.f1 < 1.0 else ""
        return StopKind.KNOWN.go_on(f"The expected F1 of the window so far {least}{ends}.")


@dataclass(frozen=True)
class SmallGain(Checked):
    """Stop when the `last` stimuli added less than `gain` to the expected F1, as the next would; never at 0.

    It takes `min_told` pairs that were learnt, or fewer where pulses have taught the recruitment curve beforehand.
    """

    gain: Share = 0.02
    last: Count = 10
    min_told: Count = 35
    min_probability: Share = 0.97

    @property
    def looks_back(self) -> int:
        """Number of past estimates that it needs."""
        return self.last + 1

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether to stop."""
        now, earlier = progress.estimate, progress.past[-self.last - 1 :]
        before = earlier[0].expected_f1 if len(earlier) > self.last else None
        if now.expected_f1 is None or now.probability is None or before is None:
            return StopKind.SMALL_GAIN.go_on(f"It is too early to say what {self.last} more stimuli would add.")
        gained = now.expected_f1 - before
        size = f"less than {self.gain:g}" if gained < self.gain else f"{gained:.2f}"
        added = f"added {size} to the expected F1"
        small = self.gain > 0 and gained < self.gain and now.probability >= self.min_probability
        if small and progress.told + GIVEN_COUNTS * progress.given >= self.min_told:
            reason = f"Another {self.last} stimuli would add little: the last {self.last} {added}."
            return _stop_unless_by_time(StopKind.SMALL_GAIN, now, reason)
        since = f"the last {self.last} stimuli {added}"
        reason = f"Too early to stop: {since}, and a window has probability {now.probability:.2f}."
        return StopKind.SMALL_GAIN.go_on(reason)


@dataclass(frozen=True)
class AnyOf:
    """Stop as soon as one of the rules, asked in order, says so; its reason is given."""

    rules: tuple[StoppingRule, ...]

    def __post_init__(self) -> None:
        if not self.rules:
            raise InvalidValueError("AnyOf needs at least one rule", got=self.rules)

    @property
    def looks_back(self) -> int:
        """Number of past estimates that its rules need."""
        return max(looks_back(rule) for rule in self.rules)

    def stimuli_left(self, delivered: int) -> int | None:
        """Number of stimuli that the least budget of its rules leaves; see `HasBudget`."""
        return min((left for r in self.rules if (left := stimuli_left(r, delivered)) is not None), default=None)

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether to stop."""
        decisions = [rule(progress) for rule in self.rules]
        for decision in decisions:
            if decision.stop:
                return decision
        reasons = dict.fromkeys(decision.reason for decision in decisions)  # what several rules say is said once
        kinds = [decision.kind for decision in decisions]
        kind = next((kind for kind in kinds if kind in OF_THE_WINDOW), kinds[0])
        return kind.go_on(" ".join(reasons))
