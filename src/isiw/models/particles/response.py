"""How a person's MEP depends on facilitation, as believed: one mixture that holds both kinds of noise.

Given input noise z, the evoked MEP relative to the EMG floor is `ratio * sigmoid(drive + spread(z))` with log-normal
output noise. A recruitment curve has a drive that is linear in the facilitation and noise on that drive (Goetz et al.;
the cohorts' `recruitment`). Noise of constant CV is the same formula far below saturation, with the logarithm of the
facilitation as the drive and log-gamma noise. The noise on the input is integrated out on equidistant nodes, whose
error is negligible because the output noise smooths between them.

    mep / floor = floor noise + ratio * gain_n * sigmoid(drive + spread_q) * output noise,     q = 1 ... Q, weights w_q

The gain belongs to trial n and not to its ISI: the first trials of a session startle, and amplitudes wander slowly.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import torch

from isiw.models.protocol import Tensor

__all__ = [
    "NoiseKind",
    "Response",
    "draw_log_mep",
    "evoked_mean",
    "log_gain",
    "log_likelihood",
    "node_weights",
    "outcome_density",
]

NODES = 16
NODE_REACH = 2.8
FAR_BELOW = 15.0
"""How far below saturation the constant-CV response sits, in logits: the sigmoid is an exponential there."""

GAMMA_KERNEL = 0.25
"""Share of the log-gamma noise that the output kernel takes over from the nodes, natural log."""

OUTLIER_PROBABILITY = 0.03
OUTLIER_LOG_RANGE = (math.log(2.0), math.log(200.0))
"""Artefacts and false positives: log-uniform between these multiples of the floor."""


STARTUP = (0.29, 0.20)
"""What the first trials have on top of the others, natural log: measured on single trials in blocks."""

PERSISTENCE = 0.97
"""How slowly amplitudes wander, from trial to trial: as an autoregressive walk relaxes towards where it will stay."""


class NoiseKind(IntEnum):
    """Where the noise enters."""

    GAIN = 0
    MISSING = 1
    RECRUITMENT = 2


class Response(NamedTuple):
    """Response parameters of many particles; all fields have the particles' shape (..., p).

    Args:
        kind: one of `NoiseKind`.
        log_floor: natural log of the median EMG floor [mV].
        floor_log_sd: SD of the floor from trial to trial, natural log.
        log_ratio: natural log of the largest evoked MEP over the floor (recruitment), or of the expected evoked MEP at
            the best ISI over the floor (constant CV).
        spread: SD of the input noise in logits (recruitment), or the CV.
        output_log_sd: SD of the output noise, natural log (recruitment).
        boost: shift of the drive at the best ISI, in logits (recruitment).
        rest: drive without a tap, in logits (recruitment).
        max_probability: probability of a response at the best ISI (missing responses).
        drift: by how much the log of evoked MEPs will have changed after many trials.
        startup: how strongly the first trials startle; 1 is `STARTUP`.
    """

    kind: Tensor
    log_floor: Tensor
    floor_log_sd: Tensor
    log_ratio: Tensor
    spread: Tensor
    output_log_sd: Tensor
    boost: Tensor
    rest: Tensor
    max_probability: Tensor
    drift: Tensor
    startup: Tensor


def log_gain(response: Response, order: Tensor) -> Tensor:
    """By how much a trial's evoked MEP differs because of when it came, natural log.

    Args:
        response: response parameters, fields of shape (..., p).
        order: how many trials came before each, shape (..., 1 or p, n).

    Returns:
        Shape (..., p, n).
    """
    startle = torch.zeros_like(order)
    for trial, excess in enumerate(STARTUP):
        startle = torch.where(order == trial, excess, startle)
    return response.drift.unsqueeze(-1) * (1.0 - PERSISTENCE**order) + response.startup.unsqueeze(-1) * startle


def _nodes(like: Tensor) -> Tensor:
    return torch.linspace(-NODE_REACH, NODE_REACH, NODES, device=like.device, dtype=like.dtype)


def node_weights(like: Tensor) -> Tensor:
    """Weights of the nodes of the input noise, shape (q,)."""
    density = torch.exp(-0.5 * _nodes(like).square())
    return density / density.sum()


def _log_gamma_nodes(cv: Tensor) -> Tensor:
    """Nodes of the log of gamma noise with mean 1, less what the output kernel adds, shape (..., p, q).

    The quantiles are Wilson and Hilferty's; they are drawn in so that nodes and kernel together have the variance of
    the quantiles, and shifted so that the mean is 1.
    """
    cv = cv.unsqueeze(-1)
    root = (1.0 - cv.square() / 9.0 + _nodes(cv) * cv / 3.0).clamp_min(0.02)
    log_quantiles = 3.0 * torch.log(root)
    weights = node_weights(cv)
    centre = (log_quantiles * weights).sum(-1, keepdim=True)
    variance = ((log_quantiles - centre).square() * weights).sum(-1, keepdim=True)
    nodes = centre + (log_quantiles - centre) * (1.0 - GAMMA_KERNEL**2 / variance).clamp_min(0.0).sqrt()
    mean = (nodes.exp() * weights).sum(-1, keepdim=True)
    return nodes - torch.log(mean) - 0.5 * GAMMA_KERNEL**2


class _Curve(NamedTuple):
    """The nodes' view of a response: evoked/floor at node q is exp(log_scale) * sigmoid(drive + spread_q)."""

    scale: Tensor  # (..., p, 1 or t)
    spread: Tensor  # (..., p, q)
    kernel: Tensor  # (..., p, 1)


def _curve(response: Response, gain: Tensor | float = 0.0) -> _Curve:
    recruits = (response.kind == NoiseKind.RECRUITMENT).unsqueeze(-1)
    input_noise = response.spread.unsqueeze(-1) * _nodes(response.spread)
    spread = torch.where(recruits, input_noise, _log_gamma_nodes(response.spread) - FAR_BELOW)
    log_scale = response.log_ratio.unsqueeze(-1) + torch.where(recruits, 0.0, FAR_BELOW) + gain
    kernel = torch.where(recruits, response.output_log_sd.unsqueeze(-1), GAMMA_KERNEL)
    return _Curve(log_scale.exp(), spread, kernel)


def _drive(response: Response, level: Tensor) -> Tensor:
    """Drive in logits by facilitation (..., p, t)."""
    recruits = (response.kind == NoiseKind.RECRUITMENT).unsqueeze(-1)
    linear = response.rest.unsqueeze(-1) + response.boost.unsqueeze(-1) * level
    return torch.where(recruits, linear, torch.log(level.clamp_min(1e-9)))


def _response_probability(response: Response, level: Tensor) -> Tensor:
    missing = (response.kind == NoiseKind.MISSING).unsqueeze(-1)
    return torch.where(missing, response.max_probability.unsqueeze(-1) * level.sqrt(), 1.0)


def evoked_mean(response: Response, level: Tensor) -> Tensor:
    """Expected MEP above the floor, in multiples of the median floor.

    Args:
        response: response parameters, fields of shape (..., p).
        level: facilitation in 0–1, shape (..., p, t).

    Returns:
        Shape (..., p, t).
    """
    curve = _curve(response)
    by_node = torch.sigmoid(_drive(response, level).unsqueeze(-1) + curve.spread.unsqueeze(-2))
    mean = curve.scale * (by_node @ node_weights(level)) * torch.exp(0.5 * curve.kernel.square())
    return mean * _response_probability(response, level)


def _components(response: Response, level: Tensor, gain: Tensor | float = 0.0) -> tuple[Tensor, Tensor]:
    """Mean and inverse SD of log(mep / floor) at each node, shapes (..., p, t, q)."""
    curve = _curve(response, gain)
    drive = _drive(response, level).unsqueeze(-1) + curve.spread.unsqueeze(-2)
    evoked = drive.sigmoid_().mul_(curve.scale.unsqueeze(-1))
    total = evoked.add(1.0)
    # The variance is that of each part by its share of the total: (evoked² kernel² + floor²) / total².
    spread = evoked.mul_(curve.kernel.unsqueeze(-1)).square_().add_(response.floor_log_sd.square()[..., None, None])
    inverse_sd = spread.rsqrt_().mul_(total)
    return total.log_(), inverse_sd


def _bell(z: Tensor) -> Tensor:
    """exp(-z² / 2) in place; what is as good as 0 stays a normal number, which is much faster."""
    z = z.clamp_(-11.0, 11.0)
    bell: Tensor = z.square_().mul_(-0.5).exp_()
    return bell


def _mix(response: Response, level: Tensor, log_relative: Tensor, evoked: Tensor) -> Tensor:
    """Density of log(mep / floor) from the density of trials that respond: missing responses and outliers added."""
    floor_sd = response.floor_log_sd.unsqueeze(-1)
    silent = torch.exp(-0.5 * (log_relative / floor_sd).square()) / (floor_sd * math.sqrt(2 * math.pi))
    low, high = OUTLIER_LOG_RANGE
    outlier = ((log_relative > low) & (log_relative < high)).to(evoked.dtype) / (high - low) + 1e-6
    responds = _response_probability(response, level)
    density = responds * evoked + (1.0 - responds) * silent
    return (1.0 - OUTLIER_PROBABILITY) * density + OUTLIER_PROBABILITY * outlier


def log_likelihood(
    response: Response, level: Tensor, log_mep: Tensor, log_mep_high: Tensor, gain: Tensor | float = 0.0
) -> Tensor:
    """Log likelihood of MEPs, trial by trial: a density of the log MEP, or the probability of an interval.

    Args:
        response: response parameters, fields of shape (..., p).
        level: facilitation of each trial, shape (..., p, n).
        log_mep: natural log of the MEPs [mV], or the lower end of what is known of them, shape (..., 1 or p, n).
        log_mep_high: the upper end; equal to `log_mep` where the amplitude is known, same shape.
        gain: `log_gain` of each trial, shape (..., p, n).

    Returns:
        Shape (..., p, n).
    """
    low, high = (end - response.log_floor.unsqueeze(-1) for end in (log_mep, log_mep_high))
    mean, inverse_sd = _components(response, level, gain)
    censored = log_mep != log_mep_high
    inside = _interval_likelihood(response, level, (low, high), mean, inverse_sd) if bool(censored.any()) else None
    terms = _bell(mean.sub_(low.unsqueeze(-1)).mul_(inverse_sd)).mul_(inverse_sd)
    evoked = (terms @ node_weights(level)) / math.sqrt(2 * math.pi)
    likelihood = torch.log(_mix(response, level, low, evoked))
    return likelihood if inside is None else torch.where(censored, inside, likelihood)


def _interval_likelihood(
    response: Response, level: Tensor, ends: tuple[Tensor, Tensor], mean: Tensor, inverse_sd: Tensor
) -> Tensor:
    """Log probability that log(mep / floor) lies between two ends, shape (..., p, n)."""

    def below(end: Tensor) -> Tensor:
        evoked: Tensor = torch.special.ndtr((end.unsqueeze(-1) - mean) * inverse_sd) @ node_weights(level)
        silent = torch.special.ndtr(end / response.floor_log_sd.unsqueeze(-1))
        first, last = OUTLIER_LOG_RANGE
        outlier = ((end - first) / (last - first)).clamp(0.0, 1.0)
        responds = _response_probability(response, level)
        mixed: Tensor = responds * evoked + (1.0 - responds) * silent
        return (1.0 - OUTLIER_PROBABILITY) * mixed + OUTLIER_PROBABILITY * outlier

    low, high = ends
    return torch.log((below(high) - below(low)).clamp_min(1e-9))


def outcome_density(response: Response, level: Tensor, log_mep: Tensor) -> Tensor:
    """Density of log MEPs at given levels of facilitation, for every combination.

    Args:
        response: response parameters, fields of shape (..., p).
        level: facilitation, shape (..., p, t).
        log_mep: natural log of MEPs [mV], shape (..., 1, y).

    Returns:
        Shape (..., p, t, y).
    """
    log_relative = log_mep - response.log_floor.unsqueeze(-1)
    mean, inverse_sd = _components(response, level)
    scaled, by = (mean * inverse_sd).unsqueeze(-2), inverse_sd.unsqueeze(-2)
    terms = _bell(torch.addcmul(scaled, log_relative[..., None, :, None], by, value=-1.0))
    evoked = (terms @ (inverse_sd * node_weights(level)).unsqueeze(-1)).squeeze(-1) / math.sqrt(2 * math.pi)
    flat = Response(*(field.unsqueeze(-1) for field in response))
    return _mix(flat, level.unsqueeze(-1), log_relative.unsqueeze(-2), evoked)


def draw_log_mep(response: Response, level: Tensor, generator: torch.Generator, gain: Tensor | float = 0.0) -> Tensor:
    """Draw natural logs of MEPs [mV] from the distribution that `log_likelihood` is of.

    Args:
        response: response parameters, fields of shape (..., p).
        level: facilitation of each trial, shape (..., p, n).
        generator: source of randomness.
        gain: `log_gain` of each trial, shape (..., p, n).

    Returns:
        Shape (..., p, n).
    """
    mean, inverse_sd = _components(response, level, gain)
    node = torch.multinomial(node_weights(level).expand(level.numel(), -1), 1, generator=generator)
    mean, inverse_sd = (x.gather(-1, node.view(*level.shape, 1)).squeeze(-1) for x in (mean, inverse_sd))
    z = torch.randn(level.shape, generator=generator, device=level.device)
    chance, artefact, place = torch.rand((3, *level.shape), generator=generator, device=level.device)
    responds = chance < _response_probability(response, level)
    log_relative = torch.where(responds, mean + z / inverse_sd, z * response.floor_log_sd.unsqueeze(-1))
    low, high = OUTLIER_LOG_RANGE
    log_relative = torch.where(artefact < OUTLIER_PROBABILITY, low + place * (high - low), log_relative)
    return log_relative + response.log_floor.unsqueeze(-1)
