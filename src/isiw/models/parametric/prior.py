"""The unknowns of the parametric window model, and their prior, made from standard normal latents without bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Final, Literal, NamedTuple

from isiw.checks import Checked, number
from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.protocol import Tensor
from isiw.models.shared.scales import AnyScale, PositiveScale, Scale
from isiw.models.shared.start import Span, StartPrior

Likelihood = Literal["gamma", "log-normal", "input-noise"]
"""Families of the MEP around its expectation."""

OUTPUT_CV: Final = 0.4
"""CV of evoked MEPs if noise on the input makes the rest of their variability; 0.3-0.5 measured."""

_COMMON = ("start", "width", "floor", "floor_cv", "outliers", "amplitude", "noise")
_INPUT_NOISE = (*_COMMON, "boost", "rest")


def latent_names(likelihood: Likelihood) -> tuple[str, ...]:
    """Names of a likelihood's latents, in order; "start" is the first."""
    return _INPUT_NOISE if likelihood == "input-noise" else _COMMON


class Unknowns(NamedTuple):
    """Of m people, (m,); the expected MEP is `baseline_mv + amplitude_mv * exp(-0.5 ((isi - centre) / sd)^2)`."""

    start_ms: Tensor  # two SDs before the centre
    width_ms: Tensor  # four SDs
    floor_mv: Tensor
    floor_cv: Tensor  # from trial to trial
    baseline_mv: Tensor  # without a tap: the floor, and what TMS alone evokes
    amplitude_mv: Tensor  # excess over the baseline at the centre
    evoked_cv: Tensor  # given the noise on the input
    saturation_mv: Tensor  # the largest evoked MEP (input noise only)
    input_sd: Tensor  # in probits (input noise only)
    p_outlier: Tensor  # that a trial has nothing to do with the ISI


_Evoked = tuple[Tensor, Tensor, Tensor, Tensor, Tensor]


@dataclass(frozen=True)
class FloorPrior(Checked):
    """Of the EMG floor.

    Args:
        mean_mv: its expectation [mV]; 6–20 µV measured, and wide enough for rigs with ten times the gain.
        cv: its CV from trial to trial; 0.12–0.35 measured.
    """

    mean_mv: PositiveScale = Scale(0.009, 0.8)
    cv: PositiveScale = Scale(0.24, 0.4)


@dataclass(frozen=True)
class InputNoisePrior(Checked):
    """Of a saturating curve with noise on its input, in probits.

    Args:
        saturation: the largest evoked MEP over the floor; 0.1–0.25 mV in forearm muscles.
        input_sd: SD of the noise on the input: 5–9 % RMT at 0.3 logits a percent, and 1.7 logits a probit.
        boost: shift of the input at the centre: 5–18 % RMT.
        rest: the input without a tap: 90 % RMT, half-maximal at RMT + 4 %.
    """

    saturation: PositiveScale = Scale(16.0, 0.6)
    input_sd: PositiveScale = Scale(1.24, 0.25)
    boost: PositiveScale = Scale(1.94, 0.45)
    rest: AnyScale = Scale(-2.7, 0.35)


@dataclass(frozen=True)
class WindowPrior(Checked):
    """The prior of the parametric window model.

    Args:
        p_window: probability that there is a window.
        start: where windows start.
        width_ms: the width; 60–220 ms, mean 108 measured [Kim2020, Table 4.1].
        floor: of the EMG floor.
        amplitude: excess at the centre over the floor; MEPs peak at 0.03–0.3 mV [Kim2020, 4.2].
        cv: CV of what is evoked; 0.36 above 2 mV, 1.1 below 0.1 mV measured.
        outliers: logit of an outlier's probability; about 2 to 7 % of a threshold's false positives.
        input_noise: of the likelihood with noise on the input.
    """

    p_window: Annotated[float, partial(number, above=0, most=1)] = 0.75
    start: StartPrior = field(default_factory=lambda: StartPrior((Span(1.0, 0.0, 125.0),), p_anywhere=0.2))
    width_ms: PositiveScale = Scale(100.0, 0.45)
    floor: FloorPrior = field(default_factory=FloorPrior)
    amplitude: PositiveScale = Scale(7.0, 0.8)
    cv: PositiveScale = Scale(0.62, 0.3)
    outliers: AnyScale = Scale(-3.5, 0.7)
    input_noise: InputNoisePrior = field(default_factory=InputNoisePrior)

    def unknowns(self, latents: Tensor, likelihood: Likelihood, space: DesignSpace) -> Unknowns:
        """The unknowns that standard normal latents stand for."""
        z = dict(zip(latent_names(likelihood), latents.unbind(-1), strict=True))
        floor_mv = self.floor.mean_mv.log_normal(z["floor"])
        evoked = self._saturating(z, floor_mv) if likelihood == "input-noise" else self._proportional(z, floor_mv)
        start_ms, width_ms = (
            self.start.start_ms(torch.special.ndtr(z["start"]), space),
            self.width_ms.log_normal(z["width"]),
        )
        floor_cv, p_outlier = self.floor.cv.log_normal(z["floor_cv"]), self.outliers.probability(z["outliers"])
        return Unknowns(start_ms, width_ms, floor_mv, floor_cv, *evoked, p_outlier)

    def _saturating(self, z: Mapping[str, Tensor], floor_mv: Tensor) -> _Evoked:
        """Baseline, amplitude, CV, saturation and input SD of a saturating curve."""
        curve = self.input_noise
        saturation_mv = floor_mv * curve.saturation.log_normal(z["amplitude"])
        input_sd, rest = curve.input_sd.log_normal(z["noise"]), curve.rest.normal(z["rest"])
        # Averaged over its noise, a probit of the input is a probit again, only flatter.
        blur, boosted = torch.sqrt(1.0 + input_sd.square()), rest + curve.boost.log_normal(z["boost"])
        at_rest, at_centre = (torch.special.ndtr(x / blur) for x in (rest, boosted))
        baseline_mv = floor_mv + saturation_mv * at_rest
        output_cv = torch.full_like(floor_mv, OUTPUT_CV)
        return baseline_mv, saturation_mv * (at_centre - at_rest), output_cv, saturation_mv, input_sd

    def _proportional(self, z: Mapping[str, Tensor], floor_mv: Tensor) -> _Evoked:
        """Baseline, amplitude, CV, saturation and input SD if the MEP is in proportion to its level."""
        amplitude_mv = floor_mv * self.amplitude.log_normal(z["amplitude"])
        ones = torch.ones_like(floor_mv)
        return floor_mv, amplitude_mv, self.cv.log_normal(z["noise"]), ones, 0.0 * ones
