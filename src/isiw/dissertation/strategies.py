"""Settings of the dissertation's methods [Kim2020, 4.2–4.6]: regressions, particle filter, and conventional sweep."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final, Literal

import numpy as np

from isiw.acquisition.fixed import OwnProposal
from isiw.acquisition.protocol import AcquisitionFunction
from isiw.acquisition.registry import acquisition_named
from isiw.checks import Checked, Count, NonNegative, Positive, whole
from isiw.decision import StopDecision, StopKind
from isiw.design import DesignSpace
from isiw.dissertation.bootstrap import BootstrapFilter
from isiw.dissertation.incremental import SweepModel
from isiw.dissertation.nonlinear import NonlinearRegression
from isiw.dissertation.regression import GaussianProcessRegression, RegressionModel, SupportVectorRegression
from isiw.models.shared.history import FloorTreatment
from isiw.strategy.decisions import Progress, StoppingRule
from isiw.strategy.settings.common import AcquisitionName, Settings
from isiw.strategy.stopping import AnyOf, Budget


@dataclass(frozen=True)
class EvenStart(Checked):
    """The ISIs that the dissertation's regressions ask for (4.3).

    Args:
        initial: how many evenly spaced ISIs to begin with, both ends of the range among them.
        acquisition: what chooses the next ISI, one of `isiw.acquisition.registry.ACQUISITIONS`; the text has none.
    """

    initial: Annotated[int, partial(whole, least=2)] = 7
    acquisition: AcquisitionName = "variance"

    def function(self, seed: int) -> AcquisitionFunction:
        """The acquisition function."""
        return acquisition_named(self.acquisition, seed)

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:
        """Evenly spaced ISIs, both ends included [ms]."""
        return tuple(np.linspace(space.low_ms, space.high_ms, self.initial).tolist())


@dataclass(frozen=True)
class OwnPlan:
    """A method that has a plan of its own: nothing can be set."""

    def function(self, seed: int) -> AcquisitionFunction:  # noqa: ARG002 - it draws nothing
        """The method's own proposal."""
        return OwnProposal()

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:  # noqa: ARG002 - others depend on the space
        """None: the plan begins with the first trial."""
        return ()


ITERATIONS = 98
"""After so many stimuli beyond the initial ones a regression gives up: the first of its 99 iterations fits the initial
ones alone (4.3)."""


@dataclass(frozen=True)
class Settling(Checked):
    """Stops when the reported edges have settled, as the dissertation's regressions do (4.3).

    Args:
        stop_variance_ms2: stop when the variance [ms²] of the last values of the edges is below this.
        stop_last: number of last values of the edges whose variance is taken.
        stop_edges: the edges whose variance has to be small: "both" (the text), or "either" (the pseudo-code).
        max_trials: stop after this many stimuli, the initial ones among them; mistrials count, control trials do not.
            By default 98 more than the initial ones, which are 99 iterations (4.3).
    """

    stop_variance_ms2: Positive = 50.0
    stop_last: Annotated[int, partial(whole, least=2)] = 5
    stop_edges: Literal["both", "either"] = "both"
    max_trials: Count | None = None

    @property
    def looks_back(self) -> int:
        """Number of past estimates that it needs."""
        return self.stop_last

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether the edges have settled."""
        windows = [estimate.window for estimate in progress.past[-self.stop_last :]]
        edges = [(window.start_ms, window.end_ms) for window in windows if window is not None]
        if len(edges) < self.stop_last:
            return StopKind.SETTLED.go_on(f"There are not {self.stop_last} windows in a row yet.")
        start, end = (statistics.variance(values) for values in zip(*edges, strict=True))
        settled = (max if self.stop_edges == "both" else min)(start, end) < self.stop_variance_ms2
        spread = f"the last {self.stop_last} values of start and end have variances of {start:.0f} and {end:.0f} ms²"
        if settled:
            return StopKind.SETTLED.stop(f"The window has settled: {spread}.")
        return StopKind.SETTLED.go_on(f"The window has not settled: {spread}.")

    def rule(self, initial: int) -> StoppingRule:
        """The edges have settled, or the budget is used up."""
        return AnyOf((self, Budget(initial + ITERATIONS if self.max_trials is None else self.max_trials)))


@dataclass(frozen=True)
class Converging(Checked):
    """Stops when a particle search has narrowed itself down: the dissertation's rule for its PF (4.6).

    Args:
        stop_sd_ms: stop when the SD of the particles is at most this [ms] (4.6).
        max_trials: stop after this many stimuli; mistrials count, control trials do not. By default as many as a full
            conventional search has (4.2.1).
    """

    stop_sd_ms: Positive = 25.0
    max_trials: Count = 600

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether the particles have converged."""
        spread_ms = progress.estimate.spread_ms
        if spread_ms is None or progress.estimate.window is None:
            return StopKind.SETTLED.go_on("No generation of particles has been measured yet.")
        spread = f"they have an SD of {spread_ms:.0f} ms"
        if spread_ms <= self.stop_sd_ms:
            return StopKind.SETTLED.stop(f"The particles have converged: {spread}.")
        return StopKind.SETTLED.go_on(f"The particles have not converged: {spread}.")

    def rule(self, initial: int) -> StoppingRule:  # noqa: ARG002 - there are no initial ISIs
        """The particles have converged, or the budget is used up."""
        return AnyOf((self, Budget(self.max_trials)))


@dataclass(frozen=True)
class Passing(Checked):
    """Stops a sweep that has left the window behind: the dissertation's manual termination (4.2.1).

    Only an estimate whose `grid_ms` is what was swept so far can be judged by it.

    Args:
        quiet_ms: stop when nothing was enhanced for so long behind a window [ms]; 0 sweeps the whole budget.
        max_trials: stop after this many stimuli; mistrials count, control trials do not. Twelve at
            each 5 ms of 500 ms are 1212.
    """

    quiet_ms: NonNegative = 25.0
    max_trials: Count = 1212

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether the window was passed."""
        window, swept_ms = progress.estimate.window, progress.estimate.grid_ms
        if window is None or swept_ms is None:
            return StopKind.SETTLED.go_on("The scan of ISIs has found no window yet.")
        behind = f"it is {swept_ms[-1] - window.end_ms:.0f} ms past the window's end"
        if swept_ms[-1] - window.end_ms >= self.quiet_ms:
            return StopKind.SETTLED.stop(f"The scan of ISIs has passed the window: {behind}.")
        return StopKind.SETTLED.go_on(f"The scan of ISIs has not passed the window: {behind}.")

    def rule(self, initial: int) -> StoppingRule:  # noqa: ARG002 - there are no initial ISIs
        """The window was passed, or the budget is used up."""
        budget = Budget(self.max_trials)
        return AnyOf((self, budget)) if self.quiet_ms else budget


NR: Final = Settings(RegressionModel(NonlinearRegression(), FloorTreatment("lowest")), EvenStart(initial=6), Settling())
SVMR: Final = Settings(RegressionModel(SupportVectorRegression(), FloorTreatment("median")), EvenStart(), Settling())
GPR: Final = Settings(RegressionModel(GaussianProcessRegression(), FloorTreatment("median")), EvenStart(), Settling())
PF: Final = Settings(BootstrapFilter(), OwnPlan(), Converging())
SWEEP: Final = Settings(SweepModel(), OwnPlan(), Passing())
"""The incremental sweep (4.2.1)."""
