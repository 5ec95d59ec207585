"""The law of the parametric window model: its unknowns, their prior, and the scatter of MEPs about their expectation.

The prior is made from standard normal latents without bounds. An MEP is the EMG floor plus what is evoked, whose means
and variances add, gamma- or log-normally distributed. With noise on the input, what is evoked is a probit function of a
fluctuating input on a few nodes, whose mixture is the model itself. A few trials are outliers, log-normal around a
multiple of the floor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Annotated, Final, Literal, NamedTuple

from isiw.checks import Checked, number
from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.parametric.normal import log_between
from isiw.models.parametric.tensors import Tensor
from isiw.models.shared.draws import NEARLY_NOTHING
from isiw.models.shared.scales import AnyScale, PositiveScale, Scale
from isiw.models.shared.start import Knots, Span, StartPrior

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


def _positive(scale: Scale, z: Tensor) -> Tensor:
    """The positive quantity at some latents, same shape."""
    return torch.exp(scale.log.normal(z))


def start_at(quantile: Tensor, knots: Knots) -> Tensor:
    """Starts [ms] at some quantiles of their law, straight between its knots, same shape."""
    below, start_ms = (torch.from_numpy(column).to(quantile) for column in (knots.below, knots.start_ms))
    right = torch.searchsorted(below, quantile.detach().contiguous()).clamp(1, len(below) - 1)
    left = right - 1
    share = (quantile - below[left]) / (below[right] - below[left]).clamp_min(1e-12)
    return start_ms[left] + share.clamp(0.0, 1.0) * (start_ms[right] - start_ms[left])


@dataclass(frozen=True)
class FloorPrior(Checked):
    """Of the EMG floor.

    Args:
        mean_mv: expectation of the floor [mV]; 6–20 µV measured, and wide enough for rigs with ten times the gain.
        cv: CV of the floor from trial to trial; 0.12–0.35 measured.
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
        floor: prior of the EMG floor.
        amplitude: excess at the centre over the floor; MEPs peak at 0.03–0.3 mV [Kim2020, 4.2].
        cv: CV of what is evoked; 0.36 above 2 mV, 1.1 below 0.1 mV measured.
        outliers: logit of an outlier's probability; about 2 to 7 % of a threshold's false positives.
        input_noise: prior of the likelihood with noise on the input.
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
        floor_mv = _positive(self.floor.mean_mv, z["floor"])
        evoked = self._saturating(z, floor_mv) if likelihood == "input-noise" else self._proportional(z, floor_mv)
        start_ms = start_at(torch.special.ndtr(z["start"]), self.start.knots(space))
        width_ms = _positive(self.width_ms, z["width"])
        floor_cv = _positive(self.floor.cv, z["floor_cv"])
        p_outlier = torch.sigmoid(self.outliers.normal(z["outliers"]))
        return Unknowns(start_ms, width_ms, floor_mv, floor_cv, *evoked, p_outlier)

    def _saturating(self, z: Mapping[str, Tensor], floor_mv: Tensor) -> _Evoked:
        """Baseline, amplitude, CV, saturation and input SD of a saturating curve."""
        curve = self.input_noise
        saturation_mv = floor_mv * _positive(curve.saturation, z["amplitude"])
        input_sd, rest = _positive(curve.input_sd, z["noise"]), curve.rest.normal(z["rest"])
        # Averaged over its noise, a probit of the input is a probit again, only flatter.
        blur, boosted = torch.sqrt(1.0 + input_sd.square()), rest + _positive(curve.boost, z["boost"])
        at_rest, at_centre = (torch.special.ndtr(x / blur) for x in (rest, boosted))
        baseline_mv = floor_mv + saturation_mv * at_rest
        output_cv = torch.full_like(floor_mv, OUTPUT_CV)
        return baseline_mv, saturation_mv * (at_centre - at_rest), output_cv, saturation_mv, input_sd

    def _proportional(self, z: Mapping[str, Tensor], floor_mv: Tensor) -> _Evoked:
        """Baseline, amplitude, CV, saturation and input SD if the MEP is in proportion to its level."""
        amplitude_mv = floor_mv * _positive(self.amplitude, z["amplitude"])
        ones = torch.ones_like(floor_mv)
        return floor_mv, amplitude_mv, _positive(self.cv, z["noise"]), ones, 0.0 * ones


NODES: Final = 12
NODE_REACH: Final = 2.6
OUTLIER_FLOORS: Final = 12.0
OUTLIER_LOG_SD: Final = 1.3
"""Outliers are log-normal, with this multiple of the floor as their median and this log SD."""

_EVER: Final = 50.0
"""No MEP is as large or as small [log mV]."""

_LOG_SQRT_2PI: Final = 0.5 * math.log(2.0 * math.pi)
_EXPONENT: Final = 8.0
"""A Gaussian with SD = width / 4 falls as exp(-8 (offset / width)^2)."""


class _Components(NamedTuple):
    """Mean and squared CV of the MEP on each node of noise on the input, shapes (q, m, n); of other noise (m, n)."""

    mean_mv: Tensor
    cv2: Tensor


def levels(unknowns: Unknowns, isi_ms: Tensor) -> Tensor:
    """Share of the largest excess at each ISI, 0 for TMS alone (NaN), shape (m, n)."""
    share = (isi_ms.nan_to_num() - unknowns.start_ms.unsqueeze(-1)) / unknowns.width_ms.unsqueeze(-1) - 0.5
    return torch.where(isi_ms.isnan(), 0.0, torch.exp(-_EXPONENT * share.square()))


@cache
def _nodes(dtype: torch.dtype) -> tuple[Tensor, Tensor]:
    """Nodes of the noise on the input [SD], and their log weights, each of shape (q,)."""
    nodes = torch.linspace(-NODE_REACH, NODE_REACH, NODES, dtype=dtype)
    return nodes, torch.log_softmax(-0.5 * nodes.square(), dim=-1)


def _components(unknowns: Unknowns, level: Tensor, likelihood: Likelihood) -> _Components:
    u = Unknowns(*(field.unsqueeze(-1) for field in unknowns))
    evoked_mv = u.baseline_mv - u.floor_mv + u.amplitude_mv * level
    if likelihood == "input-noise":
        share = (evoked_mv / u.saturation_mv).clamp(1e-9, 1.0 - 1e-9)
        drive = torch.sqrt(1.0 + u.input_sd.square()) * torch.special.ndtri(share)
        # Nodes come first: torch is faster along trials, which are many, than along nodes.
        x = drive + u.input_sd * _nodes(level.dtype)[0].view(-1, *(1 for _ in drive.shape))
        # The normal distribution function, faster than torch's own, which differs only if it is nearly 0.
        evoked_mv = u.saturation_mv * (0.5 + 0.5 * torch.erf(x * math.sqrt(0.5)))
    mean_mv = evoked_mv + u.floor_mv
    variance = (evoked_mv * u.evoked_cv).square() + (u.floor_mv * u.floor_cv).square()
    return _Components(mean_mv, variance / mean_mv.square())


def _mixed(log_terms: Tensor, likelihood: Likelihood) -> Tensor:
    """Averaged over the nodes, shape (m, n)."""
    if likelihood != "input-noise":
        return log_terms
    log_weights = _nodes(log_terms.dtype)[1].view(-1, *(1 for _ in log_terms.shape[1:]))
    return _log_sum(log_terms + log_weights)


def _log_sum(log_terms: Tensor) -> Tensor:
    """Log of the sum of what logarithms along the first dimension stand for."""
    top = log_terms.detach().amax(0).clamp_min(torch.finfo(log_terms.dtype).min)
    return torch.log(torch.exp((log_terms - top).clamp_min(NEARLY_NOTHING)).sum(0)) + top


def _log_density(parts: _Components, log_mep: Tensor, likelihood: Likelihood) -> Tensor:
    """Log density of the log MEP on each node, shape (q, m, n) or (m, n)."""
    if likelihood == "gamma":
        shape = parts.cv2.reciprocal()
        log_ratio = log_mep - torch.log(parts.mean_mv)
        return shape * (torch.log(shape) + log_ratio - torch.exp(log_ratio)) - torch.lgamma(shape)
    # What does not depend on the MEP is worked out first, as tables have many MEPs for each mean.
    variance = torch.log1p(parts.cv2)
    off = (log_mep - (torch.log(parts.mean_mv) - 0.5 * variance)) * torch.rsqrt(variance)
    return torch.addcmul(-0.5 * torch.log(variance) - _LOG_SQRT_2PI, off, off, value=-0.5)


def _normal_score(parts: _Components, log_mep: Tensor, likelihood: Likelihood) -> Tensor:
    """Standard normal variable that is as rarely smaller as an MEP is on each node, shape (q, m, n) or (m, n)."""
    if likelihood == "gamma":
        # The Wilson–Hilferty approximation [Wilson1931]: the cube root of a gamma variable is nearly normal.
        root = torch.exp((log_mep - torch.log(parts.mean_mv)) / 3.0)
        return (root - 1.0 + parts.cv2 / 9.0) * 3.0 / torch.sqrt(parts.cv2)
    variance = torch.log1p(parts.cv2)
    return (log_mep - torch.log(parts.mean_mv) + 0.5 * variance) / torch.sqrt(variance)


def log_likelihood(unknowns: Unknowns, level: Tensor, log_mep: Tensor, likelihood: Likelihood) -> Tensor:
    """Log likelihood of MEPs, trial by trial: a density of the log MEP, or the probability of an interval."""
    low, high = log_mep.unbind(-1)
    known = low == high
    parts = _components(unknowns, level, likelihood)
    at = torch.where(known, low, 0.0)
    inside = _mixed(_log_density(parts, at, likelihood), likelihood)
    outside = -0.5 * _outlier_z(unknowns, at).square() - math.log(OUTLIER_LOG_SD) - _LOG_SQRT_2PI
    if not bool(known.all()):
        high = torch.where(known, low + 1.0, high)  # ends that meet have no logarithm, nor its gradient
        inside = torch.where(known, inside, _log_between(parts, low, high, likelihood))
        outlier_z = (_outlier_z(unknowns, end) for end in _finite(low, high))
        outside = torch.where(known, outside, log_between(*outlier_z))
    p_outlier = unknowns.p_outlier.unsqueeze(-1)
    outside = (outside + torch.log(p_outlier)).expand_as(inside)
    return _log_sum(torch.stack((inside + torch.log1p(-p_outlier), outside)))


def _log_between(parts: _Components, low: Tensor, high: Tensor, likelihood: Likelihood) -> Tensor:
    from_z, to_z = (_normal_score(parts, end, likelihood) for end in _finite(low, high))
    # Below the lower end is nothing, though the cube root of a gamma variable would have a little there.
    below = torch.special.log_ndtr(to_z)
    return _mixed(torch.where(low.isneginf(), below, log_between(from_z, to_z)), likelihood)


def _finite(low: Tensor, high: Tensor) -> tuple[Tensor, Tensor]:
    """Ends of intervals of log MEPs; those at infinity would leave no gradient."""
    return torch.nan_to_num(low, neginf=-_EVER), torch.nan_to_num(high, posinf=_EVER)


def _outlier_z(unknowns: Unknowns, log_mep: Tensor) -> Tensor:
    return (log_mep - torch.log(OUTLIER_FLOORS * unknowns.floor_mv).unsqueeze(-1)) / OUTLIER_LOG_SD


def draw_log_mep(
    unknowns: Unknowns, level: Tensor, likelihood: Likelihood, generator: torch.Generator | None = None
) -> Tensor:
    """Draw natural logs of MEPs [mV], shape (m, n)."""
    parts = _components(unknowns, level, likelihood)
    if likelihood == "input-noise":
        weights = _nodes(level.dtype)[1].exp().expand(level.numel(), -1)
        node = torch.multinomial(weights, 1, generator=generator).view(1, *level.shape)
        parts = _Components(*(part.expand(NODES, *level.shape).gather(0, node).squeeze(0) for part in parts))
    mean_mv, cv2 = parts
    uniform, normal, artefact = (
        torch.rand(level.shape, generator=generator, dtype=level.dtype),
        torch.randn(level.shape, generator=generator, dtype=level.dtype),
        torch.randn(level.shape, generator=generator, dtype=level.dtype),
    )
    if likelihood == "gamma":
        shape = cv2.reciprocal().expand(level.shape).contiguous()
        log_mep = torch.log(torch._standard_gamma(shape, generator=generator) * cv2 * mean_mv)  # noqa: SLF001
    else:
        variance = torch.log1p(cv2)
        log_mep = torch.log(mean_mv) - 0.5 * variance + torch.sqrt(variance) * normal
    outlier = torch.log(OUTLIER_FLOORS * unknowns.floor_mv).unsqueeze(-1) + OUTLIER_LOG_SD * artefact
    return torch.where(uniform < unknowns.p_outlier.unsqueeze(-1), outlier, log_mep)
