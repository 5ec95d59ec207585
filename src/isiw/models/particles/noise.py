"""How a person's MEP depends on facilitation, as believed: one mixture that holds both kinds of noise.

Given input noise z, the evoked MEP relative to the EMG floor is `ratio * sigmoid(drive + spread(z))` with log-normal
output noise. A recruitment curve has a drive that is linear in the facilitation and noise on that drive (Goetz et al.;
the cohorts' `recruitment`); it may start at a threshold, below which nothing is evoked (the rectified logistic of
[Tyagi2024]). Noise of constant CV is the same formula far below saturation, with the logarithm of the facilitation as
the drive and log-gamma noise; of the same formula are responses that are all or none, whose size is not the ISI's, but
how often they come. The noise on the input is integrated out on equidistant nodes; what lies between two of them, a
normal variable too, is passed on to the output along the slope of the curve at the node.

    mep / floor = floor noise + ratio * gain_n * sigmoid(drive + spread_q) * output noise,     q = 1 ... Q, weights w_q

The gain belongs to trial n and not to its ISI: the first trials of a session startle, and amplitudes wander slowly.
"""

from __future__ import annotations

import math
from enum import IntEnum
from functools import cache
from typing import Final, NamedTuple

from isiw.lazy import torch
from isiw.models.particles.changes import Changed
from isiw.models.protocol import Tensor
from isiw.models.shared.normal import between

NODES = 8
NODE_REACH = 2.6
BETWEEN_NODES = 0.4 * 2.0 * NODE_REACH / (NODES - 1)
ON_NODES = math.sqrt(1.0 - BETWEEN_NODES**2)
"""SDs of the two parts of a standard normal variable: the one between the nodes, and the one on them."""

FAR_BELOW = 15.0
"""How far below saturation the constant-CV response sits, in logits: the sigmoid is an exponential there."""

CORNER = 0.05
"""How much of the variance between the nodes rounds the corner of the curve at a threshold: of 0.02 to 1, predictive
distributions of 30 curves were closest to simulated trials with this (decision 19)."""

STEEPEST_ROOT = 0.2
"""Where the log-gamma noise is steeper than at this root its slope is cut: such MEPs are lost in the floor."""

OUTLIER_PROBABILITY = 0.03
OUTLIER_LOG_RANGE = (math.log(2.0), math.log(200.0))
"""Artefacts and false positives: log-uniform between these multiples of the floor."""

LEAST_MASS = 1e-9
"""No interval of an amplitude is less probable than this, whatever a particle says."""

STARTUP = (0.29, 0.20)
"""What the first trials have on top of the others, natural log: measured on single trials in blocks."""

PERSISTENCE = 0.97
"""How slowly amplitudes wander, from trial to trial: as an autoregressive walk relaxes towards where it will stay."""


class NoiseKind(IntEnum):
    """Where the noise enters."""

    CONSTANT_CV = 0
    MISSING = 1
    RECRUITMENT = 2
    ALL_OR_NONE = 3
    RECTIFIED = 4


def recruits(kind: Tensor) -> Tensor:
    """Which particles have a recruitment curve, with a threshold or without, same shape."""
    return (kind == NoiseKind.RECRUITMENT) | (kind == NoiseKind.RECTIFIED)


class Response(NamedTuple):
    """Response parameters of many particles; fields have the particles' shape (..., p), logarithms are natural."""

    kind: Tensor  # one of `NoiseKind`; what is of recruitment curves here is of rectified ones too
    log_floor: Tensor  # of the median EMG floor [mV]
    floor_log_sd: Tensor  # from trial to trial
    log_ratio: Tensor  # of the largest evoked MEP (recruitment), or of the expected one at the best ISI, over the floor
    spread: Tensor  # SD of the input noise in logits (recruitment), or the CV
    output_log_sd: Tensor  # SD of the output noise (recruitment)
    boost: Tensor  # shift of the drive at the best ISI, in logits (recruitment)
    rest: Tensor  # drive without a tap, in logits (recruitment)
    onset: Tensor  # the sigmoid at the threshold (rectified); 0 where there is none
    max_probability: Tensor  # of a response at the best ISI (missing responses, all or none)
    rest_probability: Tensor  # of a response without a tap (all or none)
    drift: Tensor  # by how much the log of evoked MEPs will have changed after many trials
    startup: Tensor  # how strongly the first trials startle; 1 is `STARTUP`
    slope: Tensor  # of the drive by intensity, in logits per % RMT (recruitment)

    def changed(self, changed: Changed) -> Response:
        """The response after what has changed, fields of the particles' shape."""
        enhancement = changed.enhancement
        missing, switches = (self.kind == kind for kind in (NoiseKind.MISSING, NoiseKind.ALL_OR_NONE))
        proportional = missing | (self.kind == NoiseKind.CONSTANT_CV)
        most, least = self.max_probability, self.rest_probability
        fewer = torch.where(missing, most * enhancement.sqrt(), most)
        return self._replace(
            log_floor=self.log_floor + changed.log_scale,
            log_ratio=self.log_ratio + changed.log_gain + torch.where(proportional, enhancement.log(), 0.0),
            boost=self.boost * enhancement,
            rest=self.rest + self.slope * changed.shift_pct_rmt,
            max_probability=torch.where(switches, least + (most - least) * enhancement, fewer),
        )


def log_gain(response: Response, order: Tensor) -> Tensor:
    """By how much a trial's evoked MEP differs because of when it came, natural log."""
    startle = torch.zeros_like(order)
    for trial, excess in enumerate(STARTUP):
        startle = torch.where(order == trial, excess, startle)
    return response.drift.unsqueeze(-1) * (1.0 - PERSISTENCE**order) + response.startup.unsqueeze(-1) * startle


def _nodes(like: Tensor) -> Tensor:
    return _quadrature(like.device, like.dtype)[0]


def _node_weights(like: Tensor) -> Tensor:
    return _quadrature(like.device, like.dtype)[1]


@cache
def _quadrature(device: torch.device, dtype: torch.dtype) -> tuple[Tensor, Tensor]:
    """Nodes of the input noise, and their weights."""
    reach = NODE_REACH * ON_NODES
    nodes = torch.linspace(-reach, reach, NODES, device=device, dtype=dtype)
    density = torch.exp(-0.5 * (nodes / ON_NODES).square())
    return nodes, density / density.sum()


def _over_nodes(values: Tensor, axis: int = -2) -> Tensor:
    """Expectation over the input noise: the weighted sum along the axis of the nodes."""
    weights = _node_weights(values).view(-1, *(1 for _ in range(-1 - axis)))
    expectation: Tensor = (values * weights).sum(axis)
    return expectation


def _log_gamma_nodes(cv: Tensor) -> tuple[Tensor, Tensor]:
    """Nodes of the log of gamma noise (Wilson and Hilferty's) with mean 1, and its slope there, shapes (..., p, q)."""
    cv = cv.unsqueeze(-1)
    root = 1.0 - cv.square() / 9.0 + _nodes(cv) * cv / 3.0
    log_quantiles, slope = 3.0 * torch.log(root.clamp_min(0.02)), cv / root.clamp_min(STEEPEST_ROOT)
    mean = _over_nodes(torch.exp(log_quantiles + 0.5 * (BETWEEN_NODES * slope).square()), axis=-1)
    return log_quantiles - torch.log(mean).unsqueeze(-1), slope


class _Curve(NamedTuple):
    """The nodes' view of a response: evoked/floor at node q is scale * sigmoid(drive + spread_q)."""

    scale: Tensor  # (..., p, 1 or t)
    spread: Tensor  # (..., p, q)
    between: Tensor  # variance of its log where the sigmoid is steepest, (..., p, q)
    output: Tensor  # variance of its log whatever the drive, (..., p, 1)


def _curve(response: Response, gain: Tensor | float = 0.0) -> _Curve:
    recruits = _recruits(response)
    width = response.spread.unsqueeze(-1)
    log_gamma, slope = _log_gamma_nodes(response.spread)
    spread = torch.where(recruits, width * _nodes(width), log_gamma - FAR_BELOW)
    between = (BETWEEN_NODES * torch.where(recruits, width, slope)).square()
    log_ratio = response.log_ratio.unsqueeze(-1)
    log_scale = torch.where(recruits, log_ratio, log_ratio + FAR_BELOW) + gain
    output = torch.where(recruits, response.output_log_sd.unsqueeze(-1).square(), 0.0)
    return _Curve(log_scale.exp(), spread, between, output)


def _is(response: Response, kind: NoiseKind) -> Tensor:
    """Which particles are of a kind, shape (..., p, 1)."""
    return (response.kind == kind).unsqueeze(-1)


def _recruits(response: Response) -> Tensor:
    """Which particles have a recruitment curve, shape (..., p, 1)."""
    return recruits(response.kind).unsqueeze(-1)


def _size(response: Response, level: Tensor) -> Tensor:
    """How large a response is, as a share of that at the best ISI, by facilitation (..., p, t)."""
    return torch.where(_is(response, NoiseKind.ALL_OR_NONE), 1.0, level)


def _drive(response: Response, level: Tensor, shift_pct_rmt: Tensor | float = 0.0) -> Tensor:
    """Drive in logits by facilitation (..., p, t), and by how much stronger the pulse is."""
    linear = response.rest.unsqueeze(-1) + response.boost.unsqueeze(-1) * level
    linear = linear + response.slope.unsqueeze(-1) * shift_pct_rmt
    log_size = torch.log(_size(response, level).clamp_min(1e-9))
    return torch.where(_recruits(response), linear, log_size)


def _response_probability(response: Response, level: Tensor) -> Tensor:
    most, least = response.max_probability.unsqueeze(-1), response.rest_probability.unsqueeze(-1)
    now_and_then = torch.where(_is(response, NoiseKind.MISSING), most * level.sqrt(), 1.0)
    return torch.where(_is(response, NoiseKind.ALL_OR_NONE), least + (most - least) * level, now_and_then)


def evoked_mean(response: Response, level: Tensor) -> Tensor:
    """Expected MEP above the floor, in multiples of the median floor."""
    # The expectation is smooth in the input noise: nodes that have all of its variance are enough.
    spread = response.spread.unsqueeze(-1) * _nodes(level) / ON_NODES
    onset = response.onset[..., None, None]
    share = torch.sigmoid(_drive(response, level).unsqueeze(-2) + spread.unsqueeze(-1))
    over = _over_nodes((share - onset).clamp_min_(0.0)) / (1.0 - onset.squeeze(-1))
    recruited = over * torch.exp(0.5 * response.output_log_sd.square()).unsqueeze(-1)
    size = torch.where(_recruits(response), recruited, _size(response, level))
    mean = response.log_ratio.exp().unsqueeze(-1) * size
    return mean * _response_probability(response, level)


class Around(NamedTuple):
    """What bears on trials besides their facilitation; neutral numbers, or tensors that broadcast to (..., p, n)."""

    gain: Tensor | float = 0.0  # by how much evoked MEPs are larger, natural log
    shift_pct_rmt: Tensor | float = 0.0  # by how much the pulse is stronger
    known_mv: Tensor | float = 0.0  # a part of the amplitude that is not the pulse's
    known_sd_mv: Tensor | float = 0.0

    def in_floors(self, response: Response) -> tuple[Tensor, Tensor]:
        """The known part and its variance, in floors, shapes (..., p, 1 or n)."""
        per_floor = torch.exp(-response.log_floor).unsqueeze(-1)
        return self.known_mv * per_floor, (self.known_sd_mv * per_floor) ** 2


NOTHING: Final = Around()


def _components(response: Response, level: Tensor, around: Around = NOTHING) -> tuple[Tensor, Tensor]:
    """Mean and inverse SD of log(mep / floor) at each node, shapes (..., p, q, t)."""
    curve, (known, varies) = _curve(response, around.gain), around.in_floors(response)
    share = (_drive(response, level, around.shift_pct_rmt).unsqueeze(-2) + curve.spread.unsqueeze(-1)).sigmoid_()
    kernel = torch.sub(1.0, share).square_().mul_(curve.between.unsqueeze(-1))
    _rectify(share, kernel, curve.between, response.onset.expand(share.shape[:-2]))
    kernel.add_(curve.output.unsqueeze(-1))
    evoked = share.mul_(curve.scale.unsqueeze(-2))
    evoked_and_known = evoked + known.unsqueeze(-2)
    # The variance is that of each part by its share of the total: (evoked² kernel + floor²) / total².
    floor = response.floor_log_sd.square()[..., None] + varies
    spread = kernel.mul_(evoked).mul_(evoked).add_(floor.unsqueeze(-2))
    inverse_sd = spread.rsqrt_().mul_(evoked_and_known + 1.0)
    return evoked_and_known.log1p_(), inverse_sd


def _rectify(share: Tensor, kernel: Tensor, between: Tensor, onset: Tensor) -> None:
    """Let the curves that have a threshold start there, in place; what lies between the nodes rounds the corner."""
    rectified = onset > 0
    if not bool(rectified.any()):
        return
    start, sigmoid = onset[rectified][:, None, None], share[rectified]
    varies = (sigmoid * (1.0 - sigmoid)).square_().mul_(between.expand(share.shape[:-1])[rectified].unsqueeze(-1))
    over = sigmoid.sub_(start)
    reach = over.square().add_(varies, alpha=CORNER).clamp_min_(1e-12)
    share[rectified] = reach.sqrt().add_(over).mul_(0.5 / (1.0 - start))
    kernel[rectified] = varies.div_(reach)


def _bell(z: Tensor) -> Tensor:
    """exp(-z² / 2) in place; what is as good as 0 stays a normal number, which is much faster, as powers of 2 are."""
    bell: Tensor = z.clamp_(-11.0, 11.0).square_().mul_(-0.5 / math.log(2.0)).exp2_()
    return bell


def _silent(response: Response, around: Around) -> tuple[Tensor, Tensor]:
    """Mean and SD of log(mep / floor) where nothing is evoked, shapes (..., p, 1 or t)."""
    known, varies = around.in_floors(response)
    sd = torch.sqrt(response.floor_log_sd.square().unsqueeze(-1) + varies)
    return torch.log1p(known), sd / (1.0 + known)


def _mix(response: Response, level: Tensor, log_relative: Tensor, evoked: Tensor, around: Around = NOTHING) -> Tensor:
    """Density of log(mep / floor) from the density of trials that respond: missing responses and outliers added."""
    mean, sd = _silent(response, around)
    silent = _bell((log_relative - mean) / sd) / (sd * math.sqrt(2 * math.pi))
    low, high = OUTLIER_LOG_RANGE
    outlier = ((log_relative > low) & (log_relative < high)).to(evoked.dtype) / (high - low) + 1e-6
    responds = _response_probability(response, level)
    density = responds * evoked + (1.0 - responds) * silent
    return (1.0 - OUTLIER_PROBABILITY) * density + OUTLIER_PROBABILITY * outlier


def log_likelihood(
    response: Response, level: Tensor, log_mep: Tensor, log_mep_high: Tensor, *bearing: Tensor | float
) -> Tensor:
    """Log likelihood of MEPs, trial by trial: a density, or the probability of an interval; see `Around`."""
    around = Around(*bearing)
    low, high = (end - response.log_floor.unsqueeze(-1) for end in (log_mep, log_mep_high))
    mean, inverse_sd = _components(response, level, around)
    censored = log_mep != log_mep_high
    ends = low, high
    inside = _inside(response, level, ends, (mean, inverse_sd), around) if bool(censored.any()) else None
    terms = _bell(mean.sub_(low.unsqueeze(-2)).mul_(inverse_sd)).mul_(inverse_sd)
    evoked = _over_nodes(terms) / math.sqrt(2 * math.pi)
    likelihood = torch.log(_mix(response, level, low, evoked, around))
    return likelihood if inside is None else torch.where(censored, inside, likelihood)


def _inside(
    response: Response,
    level: Tensor,
    ends: tuple[Tensor, Tensor],
    components: tuple[Tensor, Tensor],
    around: Around,
) -> Tensor:
    """Log probability that log(mep / floor) lies between two ends, shape (..., p, n)."""
    (mean, inverse_sd), (silent_mean, silent_sd) = components, _silent(response, around)
    evoked = _over_nodes(between(*((end.unsqueeze(-2) - mean) * inverse_sd for end in ends)))
    silent = between(*((end - silent_mean) / silent_sd for end in ends))
    first, last = OUTLIER_LOG_RANGE
    from_low, to_high = (((end - first) / (last - first)).clamp(0.0, 1.0) for end in ends)
    responds = _response_probability(response, level)
    mixed = responds * evoked + (1.0 - responds) * silent
    mass = (1.0 - OUTLIER_PROBABILITY) * mixed + OUTLIER_PROBABILITY * (to_high - from_low)
    return torch.log(mass.clamp_min(LEAST_MASS))


def outcome_density(response: Response, level: Tensor, log_mep: Tensor) -> Tensor:
    """Density of log MEPs at given levels of facilitation, for every combination."""
    log_relative = log_mep - response.log_floor.unsqueeze(-1)
    mean, inverse_sd = _components(response, level)
    mean, inverse_sd = mean.unsqueeze(-1), inverse_sd.unsqueeze(-1)
    terms = _bell((log_relative[..., None, None, :] - mean).mul_(inverse_sd)).mul_(inverse_sd)
    evoked = _over_nodes(terms, axis=-3) / math.sqrt(2 * math.pi)
    flat = Response(*(field.unsqueeze(-1) for field in response))
    return _mix(flat, level.unsqueeze(-1), log_relative.unsqueeze(-2), evoked)


def draw_log_mep(response: Response, level: Tensor, generator: torch.Generator, *bearing: Tensor | float) -> Tensor:
    """Draw natural logs of MEPs [mV] from the distribution that `log_likelihood` is of."""
    mean, inverse_sd = _components(response, level, Around(*bearing))
    node = torch.multinomial(_node_weights(level), level.numel(), replacement=True, generator=generator)
    picks = node.view(level.shape).unsqueeze(-2)
    mean, inverse_sd = (x.gather(-2, picks).squeeze(-2) for x in (mean, inverse_sd))
    z = torch.randn(level.shape, generator=generator, dtype=level.dtype, device=level.device)
    size = (3, *level.shape)
    chance, artefact, place = torch.rand(size, generator=generator, dtype=level.dtype, device=level.device)
    responds = chance < _response_probability(response, level)
    log_relative = torch.where(responds, mean + z / inverse_sd, z * response.floor_log_sd.unsqueeze(-1))
    low, high = OUTLIER_LOG_RANGE
    log_relative = torch.where(artefact < OUTLIER_PROBABILITY, low + place * (high - low), log_relative)
    return log_relative + response.log_floor.unsqueeze(-1)
