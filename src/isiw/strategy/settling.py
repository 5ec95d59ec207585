"""The dissertation's rules for when to stop: when edges, particles or a sweep have settled."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal

from isiw.checks import Checked, Positive, whole
from isiw.strategy.stopping import Progress, StopDecision, StopKind


@dataclass(frozen=True)
class EdgeVariance(Checked):
    """Stop when the reported edges have settled: the dissertation's rule (4.3).

    Args:
        variance_ms2: the variance [ms²] of an edge's last values below which it has settled.
        last: how many values.
        edges: whether both edges must have settled, as the text says, or either, as its pseudo-code does.
    """

    variance_ms2: Positive = 50.0
    last: Annotated[int, partial(whole, least=2)] = 5
    edges: Literal["both", "either"] = "both"

    @property
    def looks_back(self) -> int:
        """How many past estimates it needs."""
        return self.last

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether to stop."""
        windows = [estimate.window for estimate in progress.past[-self.last :]]
        edges = [(window.start_ms, window.end_ms) for window in windows if window is not None]
        if len(edges) < self.last:
            return StopKind.SETTLED.go_on(f"There are not {self.last} windows in a row yet.")
        start, end = (statistics.variance(values) for values in zip(*edges, strict=True))
        settled = (max if self.edges == "both" else min)(start, end) < self.variance_ms2
        spread = f"the last {self.last} values of start and end have variances of {start:.0f} and {end:.0f} ms²"
        if settled:
            return StopKind.SETTLED.stop(f"The window has settled: {spread}.")
        return StopKind.SETTLED.go_on(f"The window has not settled: {spread}.")


@dataclass(frozen=True)
class ParticleSpread(Checked):
    """Stop when a particle search has narrowed itself down: the dissertation's rule for its PF (4.6).

    Args:
        sd_ms: the largest acceptable SD of the particles [ms].
    """

    sd_ms: Positive = 25.0

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether to stop."""
        spread_ms = progress.estimate.spread_ms
        if spread_ms is None or progress.estimate.window is None:
            return StopKind.SETTLED.go_on("No generation of particles has been measured yet.")
        spread = f"they have an SD of {spread_ms:.0f} ms"
        if spread_ms <= self.sd_ms:
            return StopKind.SETTLED.stop(f"The particles have converged: {spread}.")
        return StopKind.SETTLED.go_on(f"The particles have not converged: {spread}.")


@dataclass(frozen=True)
class SweptPast(Checked):
    """Stop a sweep that has left the window behind: the dissertation's manual termination (4.2.1).

    Only an estimate whose `grid_ms` is what was swept so far can be judged by it.

    Args:
        quiet_ms: how far behind the window's end nothing was enhanced [ms].
    """

    quiet_ms: Positive = 25.0

    def __call__(self, progress: Progress) -> StopDecision:
        """Decide whether to stop."""
        window, swept_ms = progress.estimate.window, progress.estimate.grid_ms
        if window is None or swept_ms is None:
            return StopKind.SETTLED.go_on("The scan of ISIs has found no window yet.")
        behind = f"it is {swept_ms[-1] - window.end_ms:.0f} ms past the window's end"
        if swept_ms[-1] - window.end_ms >= self.quiet_ms:
            return StopKind.SETTLED.stop(f"The scan of ISIs has passed the window: {behind}.")
        return StopKind.SETTLED.go_on(f"The scan of ISIs has not passed the window: {behind}.")
