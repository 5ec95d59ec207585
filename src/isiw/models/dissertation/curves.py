"""A curve fitted to the MEPs of one person: what is subtracted before, and which window follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import stdtrit

from isiw.errors import InvalidValueError
from isiw.models.shared.history import PersonTrials
from isiw.types import BoolArray, FloatArray
from isiw.window import EDGE_LEVEL, MIN_EXCESS_MV, MIN_EXCESS_OF_BASELINE

__all__ = ["FittedCurve", "Floor", "FloorKind", "Segments", "curve_masks"]

FloorKind = Literal["subtracted", "zeroed", "raw"]

Segments = Literal["peak", "all"]


@dataclass(frozen=True)
class Floor:
    """What a MEP amounts to where the tap does nothing, and what becomes of it before a curve is fitted.

    The dissertation's plots have amplitudes of zero outside the window; it does not say how they came about (4.3).

    Args:
        kind: `"subtracted"`: the floor is the mean of the MEPs of TMS alone; where there are none, the median of all
            MEPs, since most of the range is outside the window. `"zeroed"`: a MEP below the threshold is 0. `"raw"`:
            MEPs as they are; where the floor exceeds 0.135 of the peak, such a curve has no edges.
        threshold_mv: of `"zeroed"` [mV]; the dissertation's thresholds of a response are 0.015–0.033 mV (4.1.1).

    Raises:
        InvalidValueError: another kind, or a threshold that is not positive.
    """

    kind: FloorKind = "subtracted"
    threshold_mv: float = 0.025

    def __post_init__(self) -> None:
        if self.kind not in {"subtracted", "zeroed", "raw"}:
            raise InvalidValueError("the floor's kind is unknown", got=self.kind, expected="subtracted, zeroed or raw")
        if not (math.isfinite(self.threshold_mv) and self.threshold_mv > 0):
            raise InvalidValueError("threshold_mv must be positive", got=self.threshold_mv)

    def level_mv(self, trials: PersonTrials) -> float:
        """The floor [mV] of one person."""
        if self.kind != "subtracted":
            return 0.0
        if len(trials.baseline_mv):
            return float(trials.baseline_mv.mean())
        return float(np.median(trials.mep_mv)) if len(trials.mep_mv) else 0.0

    def excess_mv(self, mep_mv: FloatArray, level_mv: FloatArray | float) -> FloatArray:
        """What MEPs [mV] have above the floor [mV]; broadcast shape."""
        return np.where(mep_mv < self.threshold_mv, 0.0, mep_mv) if self.kind == "zeroed" else mep_mv - level_mv


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
    """

    grid_ms: FloatArray
    mean_mv: FloatArray
    sd_mv: FloatArray
    samples_mv: FloatArray
    noise_sd_mv: float
    dof: float = math.inf
    trouble: str | None = None
    amplitudes_mv: tuple[float, ...] = ()

    def confidence_mv(self, level: float) -> tuple[FloatArray, FloatArray]:
        """The interval that holds the expected MEP with this confidence [mV], each shape (t,)."""
        return self._about_mean(self.sd_mv, level)

    def prediction_mv(self, level: float) -> tuple[FloatArray, FloatArray]:
        """The interval that holds the next MEP with this probability [mV], each shape (t,)."""
        return self._about_mean(np.hypot(self.sd_mv, self.noise_sd_mv), level)

    def _about_mean(self, sd_mv: FloatArray, level: float) -> tuple[FloatArray, FloatArray]:
        reach = float(stdtrit(self.dof, 0.5 + 0.5 * level)) * sd_mv
        return self.mean_mv - reach, self.mean_mv + reach


def curve_masks(
    curves_mv: FloatArray, floor_mv: float, segments: Segments = "peak", level: float = EDGE_LEVEL
) -> BoolArray:
    """Which grid points lie in the windows of some curves, by the rule of `isiw.window.window_from_excess`.

    Args:
        curves_mv: expected MEPs above the floor [mV], shape (s, t).
        floor_mv: expected MEP without a tap [mV].
        segments: `"all"` of them, or the one that holds the `"peak"`.
        level: the share of the largest excess that an edge has.

    Returns:
        Shape (s, t); all False where there is no window.
    """
    peak = curves_mv.max(axis=-1, keepdims=True)
    enough = peak >= max(MIN_EXCESS_OF_BASELINE * floor_mv, MIN_EXCESS_MV)
    masks: BoolArray = enough & (curves_mv >= level * peak)
    if segments == "all":
        return masks
    gaps_before = (~masks).cumsum(axis=-1)
    at_peak = np.take_along_axis(gaps_before, curves_mv.argmax(axis=-1)[..., None], axis=-1)
    return np.asarray(masks & (gaps_before == at_peak))
