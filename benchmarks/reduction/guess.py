"""Two ways to be wrong on purpose: MEPs that say nothing of the ISI, and a regression that has made up its mind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

import isiw
from benchmarks.reduction.readings import PEOPLE
from benchmarks.reduction.recorded import SWEPT
from benchmarks.zero_trials import best_fixed, masks_of
from isiw.design import DesignSpace
from isiw.dissertation.regression import FittedCurve, RegressionModel
from isiw.subjects.measured import MEASURED_KIM
from isiw.types import FloatArray
from isiw.window import Window

__all__ = ["FIXED", "UNRELATED", "Guess", "best_for_everybody", "guessing", "unrelated"]

UNRELATED: Final = "MEPs that do not depend on the ISI"
"""Each MEP is that of an ISI drawn at random: whatever comes out has not been learnt from the person."""

FIXED: Final = "a fixed guess"
"""The window that is best for everybody, whatever is measured; of the regressions alone."""

GUESS_SEED: Final = 0
"""Of the people by whom the fixed guess is chosen; none of them is reported."""

Answer = Callable[[float], tuple[float, float]]


def unrelated(answer: Answer, space: DesignSpace, seed: int) -> Answer:
    """The same MEPs at ISIs that are not theirs.

    Args:
        answer: what answers an ISI: the told ISI [ms] and its MEP [mV].
        space: the design space.
        seed: of the draw.
    """
    rng = np.random.default_rng([seed, 2])

    def other(isi_ms: float) -> tuple[float, float]:
        return isi_ms, answer(float(rng.choice(space.grid_ms)))[1]

    return other


@dataclass(frozen=True)
class Guess:
    """A regression that has made up its mind: the same Gaussian whatever it is told.

    Args:
        window: what it reports [ms from the space's reference].
    """

    window: Window

    def fit(
        self, isi_ms: FloatArray, excess_mv: FloatArray, space: DesignSpace, rng: np.random.Generator
    ) -> FittedCurve:
        """The Gaussian whose two-sigma points are the window's edges; see `RegressionMethod`."""
        del isi_ms, rng
        grid = space.grid_ms
        height_mv = max(float(np.max(excess_mv, initial=0.0)), 0.01)
        z = (grid - 0.5 * (self.window.start_ms + self.window.end_ms)) / (0.25 * self.window.width_ms)
        curve_mv = height_mv * np.exp(-0.5 * z**2)
        return FittedCurve(grid, curve_mv, np.zeros_like(grid), np.tile(curve_mv, (2, 1)), 0.01)


def guessing(usual: isiw.Strategy, offset_ms: float) -> isiw.Strategy:
    """A regression's strategy with the guess in the place of its fit.

    Args:
        usual: the strategy.
        offset_ms: what to add to its ISIs for those from the valve command [ms].
    """
    window = best_for_everybody()
    low_ms, high_ms = (float(usual.space.snap(edge - offset_ms)) for edge in (window.start_ms, window.end_ms))
    model = RegressionModel(Guess(Window(low_ms, high_ms, ((low_ms, high_ms),))))
    return isiw.Strategy(
        usual.space, model, usual.acquisition, usual.stopping, seed=usual.seed, initial_ms=usual.initial_ms
    )


@cache
def best_for_everybody() -> Window:
    """The window with the largest mean F1 on eleven other people of `kim11-measured`, from the valve command."""
    window = best_fixed(masks_of(PEOPLE, len(MEASURED_KIM), GUESS_SEED, SWEPT), SWEPT)
    if window is None:
        raise ValueError(PEOPLE)
    return window
