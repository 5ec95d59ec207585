"""Who proposes ISIs in simulated sessions: to one person, or to some people side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from isiw.estimate import WindowEstimate
from isiw.strategy.course import Choice
from isiw.strategy.stopping import StopDecision, StopKind, StoppingRule
from isiw.strategy.strategy import Strategy
from isiw.subjects.subject import Response
from isiw.window import Window

Reported: TypeAlias = WindowEstimate | Window | None


class Player(Protocol):
    """Protocol of what proposes ISIs in a simulated session: a strategy, or what a benchmark compares it with."""

    def ask(self) -> float:
        """The next ISI [ms]."""

    def tell(self, isi_ms: float | None, mep_mv: float | None = None, *, isi_sd_ms: float = 0.0) -> None:
        """Learn from one trial.

        Args:
            isi_ms: the realised ISI [ms]; None for TMS alone.
            mep_mv: amplitude of the MEP [mV].
            isi_sd_ms: SD of the realised ISI [ms].
        """

    def estimate(self) -> Reported:
        """The estimate of the window now."""


class Crowd(Protocol):
    """What proposes ISIs to some people side by side."""

    @property
    def stopping(self) -> StoppingRule | None:
        """The rule that says when to stop with each; None where there is none."""

    def ask(self) -> Sequence[Choice]:
        """What is asked of each person next."""

    def tell(self, responses: Sequence[Response]) -> None:
        """Learn from one trial of each person."""

    def count_mistrial(self, person: int, lost: Choice) -> Choice:
        """Count a pair of stimuli that was delivered in vain, and say what is asked of the person instead."""

    def estimate(self, person: int) -> Reported:
        """The estimate of a person's window."""

    def decision(self, person: int) -> StopDecision:
        """Whether to stop with a person; asked only where there is a rule."""

    def trouble(self) -> bool | None:
        """Whether the last fit failed; None where it cannot be said for each person."""


def alone(player: Player) -> Crowd:
    """A player as a crowd of one; a strategy keeps its stopping rule, and says which asks and fits failed."""
    return _StrategyAlone(player) if isinstance(player, Strategy) else _PlayerAlone(player)


@dataclass(frozen=True)
class _StrategyAlone:
    """A strategy as a crowd of one."""

    strategy: Strategy

    @property
    def stopping(self) -> StoppingRule:
        return self.strategy.stopping

    def ask(self) -> list[Choice]:
        isi_ms = self.strategy.ask()
        return [Choice(isi_ms, self.strategy.fallback_reason)]

    def tell(self, responses: Sequence[Response]) -> None:
        (told,) = responses
        self.strategy.learn(told.isi_ms, told.mep_mv, isi_sd_ms=told.isi_sd_ms)

    def count_mistrial(self, person: int, lost: Choice) -> Choice:
        del person, lost
        self.strategy.count_mistrial()
        return self.ask()[0]

    def estimate(self, person: int) -> Reported:
        del person
        return self.strategy.estimate()

    def decision(self, person: int) -> StopDecision:
        del person
        return self.strategy.decision()

    def trouble(self) -> bool:
        return self.strategy.trouble is not None


@dataclass(frozen=True)
class _PlayerAlone:
    """Any other player as a crowd of one: it has no stopping rule, and no fit that could fail."""

    player: Player

    @property
    def stopping(self) -> None:
        return None

    def ask(self) -> list[Choice]:
        return [Choice(self.player.ask())]

    def tell(self, responses: Sequence[Response]) -> None:
        (told,) = responses
        self.player.tell(told.isi_ms, told.mep_mv, isi_sd_ms=told.isi_sd_ms)

    def count_mistrial(self, person: int, lost: Choice) -> Choice:
        del person
        return lost

    def estimate(self, person: int) -> Reported:
        del person
        return self.player.estimate()

    def decision(self, person: int) -> StopDecision:
        del person
        return StopKind.OWN.go_on("The player has no stopping rule.")

    def trouble(self) -> bool:
        return False
