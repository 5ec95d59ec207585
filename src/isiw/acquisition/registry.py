"""Acquisition functions by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from isiw.acquisition.fixed import EvenSpacing, IncrementalSweep, OwnProposal, RandomIsi, SobolIsi
from isiw.acquisition.improvement import KnowledgeGradient, LogExpectedImprovement, Thompson, UpperConfidenceBound
from isiw.acquisition.information import Alternating, MutualInformation, WindowGain, WindowInformation
from isiw.acquisition.levelset import IntegratedFeasibility, Straddle
from isiw.acquisition.protocol import AcquisitionFunction
from isiw.acquisition.twostep import TwoStep
from isiw.acquisition.variance import EdgeVariance, IntegratedVariance, ProfileVariance
from isiw.checks import choice

OWN: Final = "own"
"""Of a method with a plan of its own: what it wants itself."""

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
    OWN: lambda _seed: OwnProposal(),
}
"""Acquisition functions by name; each is made with a strategy's seed."""


def acquisition_named(name: str, seed: int) -> AcquisitionFunction:
    """The acquisition function of a name."""
    return ACQUISITIONS[choice("the acquisition function", name, ACQUISITIONS)](seed)
