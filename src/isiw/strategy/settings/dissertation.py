"""Settings of the dissertation's own methods: three regressions, a particle filter, and the conventional sweep."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal

import numpy as np

from isiw.acquisition.fixed import OwnProposal
from isiw.acquisition.protocol import AcquisitionFunction
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.dissertation.bootstrap import BootstrapFilter
from isiw.models.dissertation.curves import Floor, FloorKind, Segments
from isiw.models.dissertation.gpr import GaussianProcessRegression
from isiw.models.dissertation.incremental import SweepModel, SweepRule
from isiw.models.dissertation.nonlinear import NonlinearRegression
from isiw.models.dissertation.regression import RegressionMethod, RegressionModel
from isiw.models.dissertation.svr import SupportVectorRegression
from isiw.strategy.settings.common import acquisition_named
from isiw.strategy.stopping import AnyOf, Budget, EdgeVariance, ParticleSpread, StoppingRule, SweptPast

__all__ = ["GPRSettings", "NRSettings", "PFSettings", "SVMRSettings", "SweepSettings"]


@dataclass(frozen=True)
class RegressionSettings(ABC):
    """What the dissertation's regressions have in common (4.3).

    Args:
        initial: how many evenly spaced ISIs to begin with, both ends of the range among them.
        acquisition: what chooses the next ISI, one of `ACQUISITIONS`; the text does not define its own.
        stop_variance_ms2: stop when the variance [ms²] of the last values of the edges is below this,
        stop_last: how many values,
        stop_edges: and of which edges: "both" (the text), or "either" (the pseudo-code).
        max_iterations: stop after this many stimuli beyond the initial ones; mistrials count.
        floor: what is done about the floor: "subtracted", "zeroed" or "raw"; see `isiw.models.dissertation.curves.Floor`.
        threshold_mv: what is "zeroed" below [mV].
        segments: "all" segments of the window, or the one with the "peak".

    Raises:
        InvalidValueError: a value that cannot be.
    """

    initial: int = 7
    acquisition: str = "variance"
    stop_variance_ms2: float = 50.0
    stop_last: int = 5
    stop_edges: Literal["both", "either"] = "both"
    max_iterations: int = 99
    floor: FloorKind = "subtracted"
    threshold_mv: float = 0.025
    segments: Segments = "peak"

    def __post_init__(self) -> None:
        if isinstance(self.initial, bool) or not isinstance(self.initial, int) or self.initial < 2:
            raise InvalidValueError("initial must be a whole number of at least 2: both ends", got=self.initial)
        self.model()
        self.acquisition_function(0)
        self.stopping()

    @abstractmethod
    def method(self) -> RegressionMethod:
        """What fits the curve."""

    def model(self) -> RegressionModel:
        """The regression."""
        return RegressionModel(self.method(), Floor(self.floor, self.threshold_mv), self.segments)

    def acquisition_function(self, seed: int) -> AcquisitionFunction:
        """The acquisition function."""
        return acquisition_named(self.acquisition, seed)

    def stopping(self) -> StoppingRule:
        """The edges have settled, or the iterations are used up."""
        settled = EdgeVariance(self.stop_variance_ms2, self.stop_last, self.stop_edges)
        return AnyOf((settled, Budget(self.initial + self.max_iterations)))

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:
        """Evenly spaced ISIs, both ends included [ms]."""
        return tuple(np.linspace(space.low_ms, space.high_ms, self.initial).tolist())


@dataclass(frozen=True)
class NRSettings(RegressionSettings):
    """Nonlinear regression; the rest as in `RegressionSettings`.

    Args:
        peaks: how many Gaussians, 1 or 2.
        width_ms: width of a window before anything is known [ms] (mean of Table 4.1).
        min_width_ms: the narrowest window that is fitted [ms].
        max_width_ms: the widest [ms].
        amplitude_mv: amplitude before anything is known [mV]; 0: as much as the largest MEP so far.
    """

    initial: int = 6
    peaks: int = 1
    width_ms: float = 108.0
    min_width_ms: float = 40.0
    max_width_ms: float = 250.0
    amplitude_mv: float = 0.05

    def method(self) -> NonlinearRegression:
        """Least squares of Gaussians."""
        return NonlinearRegression(self.peaks, self.width_ms, self.min_width_ms, self.max_width_ms, self.amplitude_mv)


@dataclass(frozen=True)
class SVMRSettings(RegressionSettings):
    """Support vector regression; the rest as in `RegressionSettings`. The text gives no hyperparameters.

    Args:
        c: cost of a residual (scikit-learn's default).
        epsilon: residual that costs nothing, as a share of the largest excess (scikit-learn's default).
        length_ms: SD of the kernel [ms] (about half the mean window of Table 4.1).
        committee: regressions on bootstrapped trials, whose spread stands in for uncertainty.
    """

    c: float = 1.0
    epsilon: float = 0.1
    length_ms: float = 50.0
    committee: int = 10

    def method(self) -> SupportVectorRegression:
        """Support vector regression."""
        return SupportVectorRegression(self.c, self.epsilon, self.length_ms, self.committee)


@dataclass(frozen=True)
class GPRSettings(RegressionSettings):
    """Gaussian process regression; the rest as in `RegressionSettings`. The text gives no hyperparameters.

    Args:
        length_ms: the kernel's length where the search for it starts [ms].
        min_length_ms: shortest length [ms]: that of a window of 50 ms.
        max_length_ms: longest length [ms]: that of a window of 200 ms.
        noise: noise SD where the search starts, as a share of the largest excess.
    """

    length_ms: float = 40.0
    min_length_ms: float = 25.0
    max_length_ms: float = 100.0
    noise: float = 0.3

    def method(self) -> GaussianProcessRegression:
        """Gaussian process regression."""
        return GaussianProcessRegression(self.length_ms, self.min_length_ms, self.max_length_ms, self.noise)


@dataclass(frozen=True)
class PFSettings:
    """The bootstrap particle filter.

    Args:
        particles: how many particles, and so stimuli a generation (4.4.4: 30 or 40).
        diffusion_ms: SD of the noise on each particle [ms]; the text gives none.
        lattice_ms: particles lie on multiples of this [ms] (Fig. 4.20).
        half_width_ms: the window is the posterior expectation plus and minus this [ms] (4.3.2; Fig. 4.13 has 50).
        floor: what is done about the floor before a MEP is a weight; the text has MEPs as they are.
        threshold_mv: what is "zeroed" below [mV].
        stop_sd_ms: stop when the SD of the particles is at most this [ms] (4.6).
        max_trials: stop after this many stimuli; mistrials count (as many as a full conventional search, 4.2.1).

    Raises:
        InvalidValueError: a value that cannot be.
    """

    particles: int = 30
    diffusion_ms: float = 10.0
    lattice_ms: float = 5.0
    half_width_ms: float = 75.0
    floor: FloorKind = "raw"
    threshold_mv: float = 0.025
    stop_sd_ms: float = 25.0
    max_trials: int = 600

    def __post_init__(self) -> None:
        self.model()
        self.stopping()

    def model(self) -> BootstrapFilter:
        """The particle filter."""
        floor = Floor(self.floor, self.threshold_mv)
        return BootstrapFilter(self.particles, self.diffusion_ms, self.lattice_ms, self.half_width_ms, floor)

    def acquisition_function(self, seed: int) -> OwnProposal:  # noqa: ARG002 - the filter has its own
        """The particles."""
        return OwnProposal()

    def stopping(self) -> StoppingRule:
        """The particles have converged, or the budget is used up."""
        return AnyOf((ParticleSpread(self.stop_sd_ms), Budget(self.max_trials)))

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:  # noqa: ARG002 - others depend on the space
        """None: the first generation covers the range."""
        return ()


@dataclass(frozen=True)
class SweepSettings:
    """The incremental sweep (4.2.1).

    Args:
        step_ms: from one ISI to the next [ms].
        trials_per_isi: trials at each.
        discarded: the first so many of them are left out.
        rule: the window is where means exceed the "baseline", or the 0.135 "share" of the largest excess.
        neighbours: so many ISIs (an odd number) are averaged before the rule judges them.
        evidence_se: standard errors by which the largest of them exceeds the baseline where there is a window.
        floor: what the baseline is.
        threshold_mv: what is "zeroed" below [mV].
        quiet_ms: stop when nothing was enhanced for so long behind a window [ms]; 0 sweeps the whole budget.
        max_trials: stop after this many stimuli; mistrials count. Twelve at each 5 ms of 500 ms are 1212.

    Raises:
        InvalidValueError: a value that cannot be.
    """

    step_ms: float = 5.0
    trials_per_isi: int = 12
    discarded: int = 2
    rule: SweepRule = "baseline"
    neighbours: int = 3
    evidence_se: float = 3.0
    floor: FloorKind = "subtracted"
    threshold_mv: float = 0.025
    quiet_ms: float = 25.0
    max_trials: int = 1212

    def __post_init__(self) -> None:
        self.model()
        self.stopping()

    def model(self) -> SweepModel:
        """The means by ISI."""
        floor = Floor(self.floor, self.threshold_mv)
        return SweepModel(
            self.step_ms, self.trials_per_isi, self.discarded, self.rule, self.neighbours, self.evidence_se, floor
        )

    def acquisition_function(self, seed: int) -> OwnProposal:  # noqa: ARG002 - a sweep has no choice
        """The next ISI of the sweep."""
        return OwnProposal()

    def stopping(self) -> StoppingRule:
        """The window was passed, or the budget is used up."""
        budget = Budget(self.max_trials)
        return AnyOf((SweptPast(self.quiet_ms), budget)) if self.quiet_ms else budget

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:  # noqa: ARG002 - others depend on the space
        """None: the sweep begins at the low end."""
        return ()
