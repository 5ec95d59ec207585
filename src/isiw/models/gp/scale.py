"""The scale on which a Gaussian process describes amplitudes: transformed, centred, and in units of their spread."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from isiw.lazy import torch
from isiw.models.protocol import Tensor
from isiw.types import FloatArray

Transform: TypeAlias = Literal["log", "sqrt", "none"]

USUAL_MEP_MV = 0.02
"""Where amplitudes are believed to lie before any was told [mV]."""

USUAL_SPREAD: dict[Transform, float] = {"log": 1.0, "sqrt": 0.5, "none": 1.0}
"""SD of transformed amplitudes over ISIs and trials: of the log [nat], or as a share of their mean."""


@dataclass(frozen=True)
class Scale:
    """Standardisation of transformed amplitudes.

    Args:
        transform: what amplitudes are transformed by.
        least_mv: amplitudes below are taken for this [mV], so that 0 has a logarithm.
        centre: transformed amplitude that becomes 0.
        unit: difference of transformed amplitudes that becomes 1.
    """

    transform: Transform
    least_mv: float
    centre: float
    unit: float

    def standardised(self, mep_mv: FloatArray) -> Tensor:
        """Amplitudes [mV] on this scale, same shape."""
        return torch.as_tensor((transformed(mep_mv, self.transform, self.least_mv) - self.centre) / self.unit)

    def log_jacobian(self, mep_mv: FloatArray) -> float:
        """What turns a log density on this scale into one of log amplitudes [nat], summed over them."""
        power = {"log": 0.0, "sqrt": 0.5, "none": 1.0}[self.transform]
        log_mep = np.log(np.maximum(mep_mv, self.least_mv))
        return float(power * log_mep.sum() + len(mep_mv) * math.log((power or 1.0) / self.unit))


def transformed(mep_mv: FloatArray, transform: Transform, least_mv: float) -> FloatArray:
    """Transformed amplitudes, same shape."""
    known = np.maximum(mep_mv, least_mv)
    if transform == "none":
        return known
    return np.log(known) if transform == "log" else np.sqrt(known)


def scale_of(mep_mv: FloatArray, transform: Transform, least_mv: float) -> Scale:
    """The scale on which amplitudes have mean 0 and SD 1, as if one more of them had had the usual spread.

    That one keeps amplitudes apart that are few, or all equal.
    """
    values = transformed(mep_mv if len(mep_mv) else np.array([USUAL_MEP_MV]), transform, least_mv)
    centre = float(values.mean())
    usual = USUAL_SPREAD[transform] * (1.0 if transform == "log" else centre)
    return Scale(transform, least_mv, centre, math.sqrt((usual**2 + ((values - centre) ** 2).sum()) / len(values)))


def expected_mep_mv(level: Tensor, noise_sd: Tensor, transform: Transform) -> Tensor:
    """Expected MEP [mV] where transformed MEPs are Gaussian, broadcast shape."""
    if transform == "log":
        return torch.exp(level + 0.5 * noise_sd.square())
    # A path may run below zero where amplitudes do not.
    positive = level.clamp_min(0.0)
    return positive.square() + noise_sd.square() if transform == "sqrt" else positive
