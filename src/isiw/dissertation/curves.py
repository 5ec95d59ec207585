"""A curve fitted to the MEPs of one person, and which window follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from isiw.lazy import scipy
from isiw.types import BoolArray, FloatArray
from isiw.window import EDGE_LEVEL, least_excess_mv

Segments = Literal["peak", "all"]


@dataclass(frozen=True, eq=False)
class FittedCurve:
    """The expected MEP above the floor, by ISI, as one fit has it.

    Args:
        grid_ms: the design grid [ms], shape (t,).
        mean_mv: the curve, shape (t,).
        sd_mv: standard error of the curve, shape (t,).
        samples_mv: curves that would fit as well, shape (s, t).
        noise_sd_mv: SD of one MEP about the curve.
        dof: degrees of freedom of that SD.
        trouble: what went wrong, and what stands in for it, as full sentences; None where nothing did.
        amplitudes_mv: of the Gaussians that the curve is made of, largest first; empty where it is not made of any.
        fitted: whether trials determine it; where they do not, a curve stands in that says nothing of a window.
    """

    grid_ms: FloatArray
    mean_mv: FloatArray
    sd_mv: FloatArray
    samples_mv: FloatArray
    noise_sd_mv: float
    dof: float = math.inf
    trouble: str | None = None
    amplitudes_mv: tuple[float, ...] = ()
    fitted: bool = True

    def confidence_mv(self, level: float) -> tuple[FloatArray, FloatArray]:
        """The interval that holds the expected MEP with this confidence [mV], each shape (t,)."""
        return self._about_mean(self.sd_mv, level)

    def prediction_mv(self, level: float) -> tuple[FloatArray, FloatArray]:
        """The interval that holds the next MEP with this probability [mV], each shape (t,)."""
        return self._about_mean(np.hypot(self.sd_mv, self.noise_sd_mv), level)

    def _about_mean(self, sd_mv: FloatArray, level: float) -> tuple[FloatArray, FloatArray]:
        reach = float(scipy.special.stdtrit(self.dof, 0.5 + 0.5 * level)) * sd_mv
        return self.mean_mv - reach, self.mean_mv + reach


def curve_masks(
    curves_mv: FloatArray, floor_mv: float, segments: Segments = "peak", level: float = EDGE_LEVEL
) -> BoolArray:
    """Which grid points lie in the windows of some curves, by the rule of `isiw.window.window_from_excess`."""
    peak = curves_mv.max(axis=-1, keepdims=True)
    masks: BoolArray = curves_mv >= least_excess_mv(peak, floor_mv, level)
    if segments == "all":
        return masks
    gaps_before = (~masks).cumsum(axis=-1)
    at_peak = np.take_along_axis(gaps_before, curves_mv.argmax(axis=-1)[..., None], axis=-1)
    return np.asarray(masks & (gaps_before == at_peak))
