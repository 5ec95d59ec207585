"""The unknowns of the parametric window model, and what is believed of them before the first trial.

All unknowns are made from standard normal latents, so that the prior is the same simple thing for every likelihood and
the latents have no bounds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import torch

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.protocol import Tensor
from isiw.models.shared.start import start_ms

__all__ = ["OUTPUT_CV", "Likelihood", "Unknowns", "WindowPrior", "latent_names"]

Likelihood = Literal["gamma", "log-normal", "input-noise"]
"""Families of the MEP around its expectation."""

OUTPUT_CV: Final = 0.4
"""CV of evoked MEPs where noise on the input makes the rest of their variability; 0.3-0.5 measured."""

_COMMON = ("start", "width", "floor", "floor_cv", "outliers", "amplitude", "noise")
_INPUT_NOISE = (*_COMMON, "boost", "rest")


def latent_names(likelihood: Likelihood) -> tuple[str, ...]:
    """Names of a likelihood's latents, in order; "start" is the first."""
    return _INPUT_NOISE if likelihood == "input-noise" else _COMMON


class Unknowns(NamedTuple):
    """The unknowns of m people; all fields have the shape (m,).

    The expected MEP is `baseline_mv + amplitude_mv * exp(-0.5 ((isi - centre) / sd)^2)`, whatever the likelihood.

    Args:
        start_ms: start of the window: two SDs before the centre [ms].
        width_ms: its width: four SDs [ms].
        floor_mv: expected EMG floor [mV].
        floor_cv: its CV from trial to trial.
        baseline_mv: expected MEP without a tap [mV]: the floor, and what TMS alone evokes.
        amplitude_mv: expected excess over the baseline at the centre [mV].
        evoked_cv: CV of what is evoked, given the noise on the input.
        saturation_mv: the largest evoked MEP [mV] (input noise only).
        input_sd: SD of the noise on the input, in probits (input noise only).
        p_outlier: probability that a trial has nothing to do with the ISI.
    """

    start_ms: Tensor
    width_ms: Tensor
    floor_mv: Tensor
    floor_cv: Tensor
    baseline_mv: Tensor
    amplitude_mv: Tensor
    evoked_cv: Tensor
    saturation_mv: Tensor
    input_sd: Tensor
    p_outlier: Tensor


@dataclass(frozen=True)
class WindowPrior:
    """The prior of the parametric window model. Pairs are median and log SD of a log-normal where not said otherwise.

    Args:
        p_window: probability that there is a window.
        start_ms: where windows start after the impact [ms], uniform between these.
        hit_delay_ms: mean and SD of the hit delay of a person unknown [ms]; 172–188 ms measured (dissertation, 4.2).
        p_anywhere: probability that a window starts anywhere in the range instead, for stimulators unlike that one;
            more in a range that only a part of the usual starts lies in.
        width_ms: the width; 60–220 ms, mean 108 measured (dissertation, Table 4.1).
        floor_mv: the EMG floor; 6–20 µV measured, and wide enough for rigs with ten times the gain.
        floor_cv: its CV; 0.12–0.35 measured.
        amplitude: excess at the centre over the floor; MEPs peak at 0.03–0.3 mV (dissertation, 4.2).
        cv: CV of what is evoked; 0.36 above 2 mV, 1.1 below 0.1 mV measured.
        outliers: mean and SD of the logit of an outlier's probability; about 2 to 7 % of a threshold's false positives.
        saturation: the largest evoked MEP over the floor; 0.1–0.25 mV in forearm muscles.
        input_sd: noise on the input: 5–9 % RMT at 0.3 logits a percent, and 1.7 logits a probit.
        boost: shift of the input at the centre: 5–18 % RMT, in probits.
        rest: mean and SD of the input without a tap, in probits: 90 % RMT, half-maximal at RMT + 4 %.

    Raises:
        InvalidValueError: something that is no probability, or a median or SD that is not positive.
    """

    p_window: float = 0.75
    start_ms: tuple[float, float] = (0.0, 125.0)
    hit_delay_ms: tuple[float, float] = (180.0, 7.0)
    p_anywhere: float = 0.2
    width_ms: tuple[float, float] = (100.0, 0.45)
    floor_mv: tuple[float, float] = (0.009, 0.8)
    floor_cv: tuple[float, float] = (0.24, 0.4)
    amplitude: tuple[float, float] = (7.0, 0.8)
    cv: tuple[float, float] = (0.62, 0.3)
    outliers: tuple[float, float] = (-3.5, 0.7)
    saturation: tuple[float, float] = (16.0, 0.6)
    input_sd: tuple[float, float] = (1.24, 0.25)
    boost: tuple[float, float] = (1.94, 0.45)
    rest: tuple[float, float] = (-2.7, 0.35)

    def __post_init__(self) -> None:
        if not (0.0 < self.p_window <= 1.0 and 0.0 <= self.p_anywhere <= 1.0):
            raise InvalidValueError(
                "p_window and p_anywhere must be probabilities", got=(self.p_window, self.p_anywhere)
            )
        for name in (
            "hit_delay_ms",
            "width_ms",
            "floor_mv",
            "floor_cv",
            "amplitude",
            "cv",
            "saturation",
            "input_sd",
            "boost",
        ):
            if not all(math.isfinite(value) and value > 0 for value in getattr(self, name)):
                raise InvalidValueError(f"{name} must be positive", got=getattr(self, name))
        if not (self.outliers[1] > 0 and self.rest[1] > 0):
            raise InvalidValueError("an SD must be positive", got=(self.outliers, self.rest))
        if not self.start_ms[0] < self.start_ms[1]:
            raise InvalidValueError("start_ms is empty", got=self.start_ms, expected="earliest < latest")

    def unknowns(self, latents: Tensor, likelihood: Likelihood, space: DesignSpace) -> Unknowns:
        """What standard normal latents mean.

        Args:
            latents: in the order of `latent_names`, shape (m, d).
            likelihood: the likelihood.
            space: the design space.
        """
        z = dict(zip(latent_names(likelihood), latents.unbind(-1), strict=True))
        floor_mv = _log_normal(z["floor"], self.floor_mv)
        ones = torch.ones_like(floor_mv)
        if likelihood == "input-noise":
            saturation_mv, input_sd = (
                floor_mv * _log_normal(z["amplitude"], self.saturation),
                _log_normal(z["noise"], self.input_sd),
            )
            blur = torch.sqrt(1.0 + input_sd.square())
            rest = self.rest[0] + self.rest[1] * z["rest"]
            # Averaged over its noise, a probit of the input is a probit again, only flatter.
            at_rest, at_centre = (
                torch.special.ndtr(x / blur) for x in (rest, rest + _log_normal(z["boost"], self.boost))
            )
            evoked = (
                floor_mv + saturation_mv * at_rest,
                saturation_mv * (at_centre - at_rest),
                OUTPUT_CV * ones,
                saturation_mv,
                input_sd,
            )
        else:
            evoked = (
                floor_mv,
                floor_mv * _log_normal(z["amplitude"], self.amplitude),
                _log_normal(z["noise"], self.cv),
                ones,
                0.0 * ones,
            )
        return Unknowns(
            start_ms(z["start"], space, self.start_ms, self.hit_delay_ms, self.p_anywhere),
            _log_normal(z["width"], self.width_ms),
            floor_mv,
            _log_normal(z["floor_cv"], self.floor_cv),
            *evoked,
            p_outlier=torch.sigmoid(self.outliers[0] + self.outliers[1] * z["outliers"]),
        )


def _log_normal(z: Tensor, median_and_log_sd: tuple[float, float]) -> Tensor:
    median, log_sd = median_and_log_sd
    return median * torch.exp(log_sd * z)
