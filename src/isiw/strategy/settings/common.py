"""What the families of strategies share: acquisition functions by name, and when a posterior is known well enough."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from isiw.acquisition.fixed import EvenSpacing, IncrementalSweep, OwnProposal, RandomIsi, SobolIsi
from isiw.acquisition.improvement import KnowledgeGradient, LogExpectedImprovement, Thompson, UpperConfidenceBound
from isiw.acquisition.information import Alternating, MutualInformation, WindowGain, WindowInformation
from isiw.acquisition.levelset import IntegratedFeasibility, Straddle
from isiw.acquisition.protocol import AcquisitionFunction
from isiw.acquisition.twostep import TwoStep
from isiw.acquisition.variance import EdgeVariance, IntegratedVariance, ProfileVariance
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.protocol import ResponseModel
from isiw.strategy.stopping import AnyOf, Budget, CredibleWidth, NoWindow, StoppingRule

__all__ = ["ACQUISITIONS", "PosteriorSettings", "Settings", "acquisition_named"]

ACQUISITIONS: Final[Mapping[str, Callable[[int], AcquisitionFunction]]] = {
    "alternating": lambda _seed: Alternating(),
    "window-gain": lambda _seed: WindowGain(),
    "window-information": lambda _seed: WindowInformation(),
    "mutual-information": lambda _seed: MutualInformation(),
    "two-step": lambda _seed: TwoStep(),
    "edge-variance": lambda _seed: EdgeVariance(),
    "straddle": lambda _seed: Straddle(),
    "feasibility": lambda _seed: IntegratedFeasibility(),
    "variance": lambda _seed: ProfileVariance(),
    "integrated-variance": lambda _seed: IntegratedVariance(),
    "log-ei": lambda _seed: LogExpectedImprovement(),
    "ucb": lambda _seed: UpperConfidenceBound(),
    "thompson": Thompson,
    "knowledge-gradient": lambda _seed: KnowledgeGradient(),
    "even": lambda _seed: EvenSpacing(),
    "sobol": SobolIsi,
    "random": RandomIsi,
    "sweep": lambda _seed: IncrementalSweep(),
    "own": lambda _seed: OwnProposal(),
}
"""Acquisition functions by name; each is made with a strategy's seed."""


def acquisition_named(name: str, seed: int) -> AcquisitionFunction:
    """The acquisition function of a name.

    Raises:
        InvalidValueError: there is none.
    """
    if name not in ACQUISITIONS:
        raise InvalidValueError("there is no such acquisition function", got=name, expected=", ".join(ACQUISITIONS))
    return ACQUISITIONS[name](seed)


class Settings(Protocol):
    """Settings of one family of strategies: a frozen dataclass whose fields are TOML values.

    Constructing it checks every field, by making the parts once.
    """

    def model(self) -> ResponseModel:
        """The model."""

    def acquisition_function(self, seed: int) -> AcquisitionFunction:
        """The acquisition function."""

    def stopping(self) -> StoppingRule:
        """When to stop."""

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:
        """The ISIs to ask for first [ms]."""


@dataclass(frozen=True)
class PosteriorSettings(ABC):
    """Settings of all families whose model has a posterior of the window.

    Args:
        acquisition: what chooses the next ISI, one of `ACQUISITIONS`.
        initial_trials: how many evenly spaced ISIs to ask for first.
        max_trials: stop after this many stimuli; mistrials count.
        stop_width_ms: stop when the 90 % credible intervals of both edges are at most this wide [ms], under every kind
            of noise that is still probable where the model weighs more than one.
        stop_no_window: stop when "there is no window" is at least this probable.

    Raises:
        InvalidValueError: a value that cannot be.
    """

    acquisition: str = "alternating"
    initial_trials: int = 0
    max_trials: int = 80
    stop_width_ms: float = 30.0
    stop_no_window: float = 0.9

    def __post_init__(self) -> None:
        self.model()
        self.acquisition_function(0)
        self.stopping()
        if isinstance(self.initial_trials, bool) or not isinstance(self.initial_trials, int) or self.initial_trials < 0:
            raise InvalidValueError("initial_trials must be a whole number from 0 up", got=self.initial_trials)

    @abstractmethod
    def model(self) -> ResponseModel:
        """The model."""

    def acquisition_function(self, seed: int) -> AcquisitionFunction:
        """The acquisition function."""
        return acquisition_named(self.acquisition, seed)

    def stopping(self) -> StoppingRule:
        """Known well enough, no window, or the budget used up."""
        return AnyOf((CredibleWidth(self.stop_width_ms), NoWindow(self.stop_no_window), Budget(self.max_trials)))

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:
        """The middles of equal parts of the range [ms]."""
        part_ms = (space.high_ms - space.low_ms) / max(1, self.initial_trials)
        return tuple(space.low_ms + (part + 0.5) * part_ms for part in range(self.initial_trials))
