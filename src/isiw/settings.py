"""What can be set about the named strategies, family by family, and what is built from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

from isiw.acquisition.improvement import KnowledgeGradient, LogExpectedImprovement, Thompson, UpperConfidenceBound
from isiw.acquisition.information import Alternating, MutualInformation, WindowGain, WindowInformation
from isiw.acquisition.levelset import IntegratedFeasibility, Straddle
from isiw.acquisition.protocol import AcquisitionFunction
from isiw.acquisition.sweeps import EvenSpacing, IncrementalSweep, OwnProposal, RandomIsi, SobolIsi
from isiw.acquisition.variance import EdgeVariance, IntegratedVariance, ProfileVariance
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.gp import GaussianProcess
from isiw.models.gp_prior import HyperparameterPrior
from isiw.models.particles import ParticleModel
from isiw.models.prior import Prior
from isiw.models.protocol import ResponseModel
from isiw.stopping import AnyOf, Budget, CredibleWidth, NoWindow, StoppingRule

__all__ = ["ACQUISITIONS", "GPSettings", "ParticleSettings", "Settings", "acquisition_named", "known_well_enough"]

ACQUISITIONS: Final[Mapping[str, Callable[[int], AcquisitionFunction]]] = {
    "alternating": lambda _seed: Alternating(),
    "window-gain": lambda _seed: WindowGain(),
    "window-information": lambda _seed: WindowInformation(),
    "mutual-information": lambda _seed: MutualInformation(),
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


def known_well_enough(max_trials: int, stop_width_ms: float, stop_no_window: float) -> StoppingRule:
    """Both edges known, or no window, or the budget used up: for strategies with a posterior of the window."""
    return AnyOf((CredibleWidth(stop_width_ms), NoWindow(stop_no_window), Budget(max_trials)))


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
class ParticleSettings:
    """Strategies on the particle posterior.

    Args:
        acquisition: what chooses the next ISI, one of `ACQUISITIONS`.
        max_trials: stop after this many stimuli; mistrials count.
        stop_width_ms: stop when the 90 % credible intervals of both edges are at most this wide [ms].
        stop_no_window: stop when "there is no window" is at least this probable.
        particles: how many particles the posterior has.
        prior: settings of `isiw.models.prior.Prior` that differ from its defaults.
        detection_limit_mv: what a told amplitude of 0 is known to be below [mV].
        response_threshold_mv: what a told response is known to be above [mV].

    Raises:
        InvalidValueError: a value that cannot be, or a setting that the prior does not have.
    """

    acquisition: str = "alternating"
    max_trials: int = 80
    stop_width_ms: float = 30.0
    stop_no_window: float = 0.9
    particles: int = 1000
    prior: Mapping[str, Any] = field(default_factory=dict)
    detection_limit_mv: float = 0.005
    response_threshold_mv: float = 0.02

    def __post_init__(self) -> None:
        self.model()
        self.acquisition_function(0)
        self.stopping()

    def model(self) -> ParticleModel:
        """The particle model."""
        return ParticleModel(
            beliefs=Prior.from_settings(self.prior),
            particles=self.particles,
            detection_limit_mv=self.detection_limit_mv,
            response_threshold_mv=self.response_threshold_mv,
        )

    def acquisition_function(self, seed: int) -> AcquisitionFunction:
        """The acquisition function."""
        return acquisition_named(self.acquisition, seed)

    def stopping(self) -> StoppingRule:
        """Known well enough, no window, or the budget used up."""
        return known_well_enough(self.max_trials, self.stop_width_ms, self.stop_no_window)

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:  # noqa: ARG002 - others depend on the space
        """None: the prior knows where to begin."""
        return ()


@dataclass(frozen=True)
class GPSettings:
    """Strategies on a Gaussian process.

    Args:
        acquisition: what chooses the next ISI, one of `ACQUISITIONS`.
        max_trials: stop after this many stimuli; mistrials count.
        stop_width_ms: stop when the 90 % credible intervals of both edges are at most this wide [ms].
        stop_no_window: stop when "there is no window" is at least this probable.
        initial_trials: how many evenly spaced ISIs to ask for first.
        kernel: `"rbf"` or `"matern"`.
        noise: `"equal"` at all ISIs, or `"by-isi"`.
        transform: of the MEP: `"log"`, `"sqrt"` or `"none"`.
        hyperparameters: `"marginalised"`, or the most likely ones, `"map"`.
        floor: what the 0.135 rule is applied above: `"subtracted"`, `"zeroed"` or `"raw"`; as in `GaussianProcess`.
        samples: how many paths represent the posterior.
        prior: settings of `isiw.models.gp_prior.HyperparameterPrior` that differ from its defaults.
        detection_limit_mv: what a told amplitude of 0 is known to be below [mV].
        zero_below_mv: threshold of the floor `"zeroed"` [mV].

    Raises:
        InvalidValueError: a value that cannot be, or a setting that the prior does not have.
    """

    acquisition: str = "straddle"
    max_trials: int = 80
    stop_width_ms: float = 30.0
    stop_no_window: float = 0.9
    initial_trials: int = 5
    kernel: str = "matern"
    noise: str = "equal"
    transform: str = "log"
    hyperparameters: str = "marginalised"
    floor: str = "subtracted"
    samples: int = 256
    prior: Mapping[str, Any] = field(default_factory=dict)
    detection_limit_mv: float = 0.005
    zero_below_mv: float = 0.025

    def __post_init__(self) -> None:
        self.model()
        self.acquisition_function(0)
        self.stopping()
        if isinstance(self.initial_trials, bool) or not isinstance(self.initial_trials, int) or self.initial_trials < 0:
            raise InvalidValueError("initial_trials must be a whole number from 0 up", got=self.initial_trials)

    def model(self) -> GaussianProcess:
        """The Gaussian process."""
        names = ("kernel", "noise", "transform", "hyperparameters", "floor", "samples")
        chosen = {name: getattr(self, name) for name in (*names, "detection_limit_mv", "zero_below_mv")}
        return GaussianProcess(beliefs=HyperparameterPrior.from_settings(self.prior), **chosen)

    def acquisition_function(self, seed: int) -> AcquisitionFunction:
        """The acquisition function."""
        return acquisition_named(self.acquisition, seed)

    def stopping(self) -> StoppingRule:
        """Known well enough, no window, or the budget used up."""
        return known_well_enough(self.max_trials, self.stop_width_ms, self.stop_no_window)

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:
        """The middles of equal parts of the range [ms]."""
        part_ms = (space.high_ms - space.low_ms) / max(1, self.initial_trials)
        return tuple(space.low_ms + (part + 0.5) * part_ms for part in range(self.initial_trials))
