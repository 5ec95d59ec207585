"""The scatter of MEPs around their expectation in the parametric window model: densities, intervals, and draws.

An MEP is the EMG floor plus what is evoked, whose means and variances add, gamma- or log-normally distributed. With
noise on the input, what is evoked is a probit function of a fluctuating input on a few nodes, whose mixture is the
model itself. A few trials are outliers, log-normal around a multiple of the floor.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from isiw.lazy import torch
from isiw.models.parametric.prior import Likelihood, Unknowns
from isiw.models.protocol import Tensor

NODES: Final = 12
NODE_REACH: Final = 2.6
OUTLIER_FLOORS: Final = 12.0
OUTLIER_LOG_SD: Final = 1.3
"""Outliers are log-normal, with this multiple of the floor as their median and this log SD."""

_LOG_SQRT_2PI: Final = 0.5 * math.log(2.0 * math.pi)
_EXPONENT: Final = 8.0
"""A Gaussian with SD = width / 4 falls as exp(-8 (offset / width)^2)."""


class _Components(NamedTuple):
    """Mean and squared CV of the MEP on each node, shapes (m, n, q)."""

    mean_mv: Tensor
    cv2: Tensor


def levels(unknowns: Unknowns, isi_ms: Tensor) -> Tensor:
    """Share of the largest excess at each ISI, 0 for TMS alone (NaN), shape (m, n)."""
    share = (isi_ms.nan_to_num() - unknowns.start_ms.unsqueeze(-1)) / unknowns.width_ms.unsqueeze(-1) - 0.5
    return torch.where(isi_ms.isnan(), 0.0, torch.exp(-_EXPONENT * share.square()))


def _nodes(like: Tensor) -> tuple[Tensor, Tensor]:
    """Nodes of the noise on the input [SD], and their log weights, each of shape (q,)."""
    nodes = torch.linspace(-NODE_REACH, NODE_REACH, NODES, dtype=like.dtype, device=like.device)
    return nodes, torch.log_softmax(-0.5 * nodes.square(), dim=-1)


def _components(unknowns: Unknowns, level: Tensor, likelihood: Likelihood) -> _Components:
    u = Unknowns(*(field.unsqueeze(-1) for field in unknowns))
    evoked_mv = (u.baseline_mv - u.floor_mv + u.amplitude_mv * level).unsqueeze(-1)
    if likelihood == "input-noise":
        saturation_mv, input_sd = u.saturation_mv.unsqueeze(-1), u.input_sd.unsqueeze(-1)
        share = (evoked_mv / saturation_mv).clamp(1e-9, 1.0 - 1e-9)
        drive = torch.sqrt(1.0 + input_sd.square()) * torch.special.ndtri(share)
        x = drive + input_sd * _nodes(level)[0]
        # The normal distribution function, faster than torch's own, which differs only if it is nearly 0.
        evoked_mv = saturation_mv * (0.5 + 0.5 * torch.erf(x * math.sqrt(0.5)))
    mean_mv = evoked_mv + u.floor_mv.unsqueeze(-1)
    variance = (evoked_mv * u.evoked_cv.unsqueeze(-1)).square() + (u.floor_mv * u.floor_cv).square().unsqueeze(-1)
    return _Components(mean_mv, variance / mean_mv.square())


def _mixed(log_terms: Tensor, likelihood: Likelihood) -> Tensor:
    """Averaged over the nodes, shape (m, n)."""
    if likelihood != "input-noise":
        return log_terms.squeeze(-1)
    return torch.logsumexp(log_terms + _nodes(log_terms)[1], dim=-1)


def _log_density(parts: _Components, log_mep: Tensor, likelihood: Likelihood) -> Tensor:
    """Log density of the log MEP on each node, shape (m, n, q)."""
    if likelihood == "gamma":
        shape = parts.cv2.reciprocal()
        log_ratio = log_mep - torch.log(parts.mean_mv)
        return shape * (torch.log(shape) + log_ratio - torch.exp(log_ratio)) - torch.lgamma(shape)
    variance = torch.log1p(parts.cv2)
    off = log_mep - torch.log(parts.mean_mv) + 0.5 * variance
    return -0.5 * (off.square() / variance + torch.log(variance)) - _LOG_SQRT_2PI


def _below(parts: _Components, log_mep: Tensor, likelihood: Likelihood) -> Tensor:
    """Probability of a smaller MEP on each node, shape (m, n, q)."""
    if likelihood == "gamma":
        # The Wilson–Hilferty approximation [Wilson1931]: the cube root of a gamma variable is nearly normal.
        root = torch.exp((log_mep - torch.log(parts.mean_mv)) / 3.0)
        z = (root - 1.0 + parts.cv2 / 9.0) * 3.0 / torch.sqrt(parts.cv2)
    else:
        variance = torch.log1p(parts.cv2)
        z = (log_mep - torch.log(parts.mean_mv) + 0.5 * variance) / torch.sqrt(variance)
    below: Tensor = torch.special.ndtr(z)
    return below


def log_likelihood(unknowns: Unknowns, level: Tensor, log_mep: Tensor, likelihood: Likelihood) -> Tensor:
    """Log likelihood of MEPs, trial by trial: a density of the log MEP, or the probability of an interval."""
    low, high = log_mep.unbind(-1)
    known = low == high
    parts = _components(unknowns, level, likelihood)
    at = torch.where(known, low, 0.0)
    inside = _mixed(_log_density(parts, at.unsqueeze(-1), likelihood), likelihood)
    outside = -0.5 * _outlier_z(unknowns, at).square() - math.log(OUTLIER_LOG_SD) - _LOG_SQRT_2PI
    if not bool(known.all()):
        inside = torch.where(known, inside, _log_between(parts, low, high, likelihood))
        below_high, below_low = (torch.special.ndtr(_outlier_z(unknowns, end)) for end in (high, low))
        outside = torch.where(known, outside, torch.log((below_high - below_low).clamp_min(1e-300)))
    p_outlier = unknowns.p_outlier.unsqueeze(-1)
    return torch.logaddexp(inside + torch.log1p(-p_outlier), outside + torch.log(p_outlier))


def _log_between(parts: _Components, low: Tensor, high: Tensor, likelihood: Likelihood) -> Tensor:
    # Ends at infinity leave no gradient of their own, and below the lower one is nothing.
    ends = (torch.nan_to_num(end, neginf=-50.0, posinf=50.0).unsqueeze(-1) for end in (high, low))
    to_high, to_low = (_below(parts, end, likelihood) for end in ends)
    to_low = torch.where(low.isneginf().unsqueeze(-1), 0.0, to_low)
    return _mixed(torch.log((to_high - to_low).clamp_min(1e-300)), likelihood)


def _outlier_z(unknowns: Unknowns, log_mep: Tensor) -> Tensor:
    return (log_mep - torch.log(OUTLIER_FLOORS * unknowns.floor_mv).unsqueeze(-1)) / OUTLIER_LOG_SD


def draw_log_mep(
    unknowns: Unknowns, level: Tensor, likelihood: Likelihood, generator: torch.Generator | None = None
) -> Tensor:
    """Draw natural logs of MEPs [mV], shape (m, n)."""
    parts = _components(unknowns, level, likelihood)
    if likelihood == "input-noise":
        weights = _nodes(level)[1].exp().expand(level.numel(), -1)
        node = torch.multinomial(weights, 1, generator=generator).view(*level.shape, 1)
        parts = _Components(*(part.expand(*level.shape, NODES).gather(-1, node) for part in parts))
    mean_mv, cv2 = (part.squeeze(-1) for part in parts)
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
