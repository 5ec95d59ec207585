"""Support vector regression with a Gaussian kernel: the dissertation's SVMR [Kim2020, 4.3]."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np

from isiw.checks import Checked, NonNegative, Positive, whole
from isiw.design import DesignSpace
from isiw.lazy import sklearn
from isiw.models.dissertation.curves import FittedCurve
from isiw.types import FloatArray

LEAST_SCALE_MV = 1e-3
"""Amplitudes are fitted in units of the largest excess, or of this where that is smaller [mV]."""


@dataclass(frozen=True)
class SupportVectorRegression(Checked):
    """scikit-learn's SVR, and a committee of it on bootstrapped trials.

    A support vector regression has no uncertainty of its own: the spread of the committee stands in for it. The text
    gives no hyperparameters.

    Args:
        c: cost of a residual, per MEP.
        epsilon: residual that costs nothing, as a share of the largest excess.
        length_ms: SD of the kernel [ms]; scikit-learn's gamma is 1 / (2 length²).
        committee: how many regressions on bootstrapped trials.
    """

    c: Positive = 1.0
    epsilon: NonNegative = 0.1
    length_ms: Positive = 50.0
    committee: Annotated[int, partial(whole, least=2)] = 10

    def fit(
        self, isi_ms: FloatArray, excess_mv: FloatArray, space: DesignSpace, rng: np.random.Generator
    ) -> FittedCurve:
        """Fit the regression and its committee; see `RegressionMethod`."""
        grid = space.grid_ms
        if not len(isi_ms):
            flat = np.zeros(len(grid))
            trouble = "There are no trials to fit yet: a flat curve stands in."
            return FittedCurve(grid, flat, flat, np.tile(flat, (self.committee, 1)), 0.0, trouble=trouble, fitted=False)
        scale_mv = max(float(np.abs(excess_mv).max()), LEAST_SCALE_MV)
        regression = sklearn.svm.SVR(C=self.c, epsilon=self.epsilon, gamma=0.5 / self.length_ms**2)
        isi, scaled = isi_ms[:, None], excess_mv / scale_mv
        picks = rng.integers(len(isi), size=(self.committee, len(isi)))
        members_mv = np.stack([regression.fit(isi[i], scaled[i]).predict(grid[:, None]) for i in picks]) * scale_mv
        regression.fit(isi, scaled)
        return FittedCurve(
            grid_ms=grid,
            mean_mv=regression.predict(grid[:, None]) * scale_mv,
            sd_mv=members_mv.std(axis=0),
            samples_mv=members_mv,
            noise_sd_mv=float(np.sqrt(np.mean((regression.predict(isi) - scaled) ** 2))) * scale_mv,
        )
