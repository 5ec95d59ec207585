"""Tables of a prior over people, for kernels: the law of each block of latents, and what moves may do to a particle.

The latents of every model are those of the default, in another order, and fewer or more: `at` says where each is.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from isiw.compiled import exp, log, loop, part
from isiw.models.particles.changes import FADING, INTENSITY_PCT, ChangeKind
from isiw.models.particles.kernels import records as field
from isiw.models.particles.kernels.draws import normal, uniform
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import MOST_ONSET
from isiw.types import FloatArray, IntArray

KINDS: Final = 5
"""Of a particle: its profile's shape, its noise, whether there is an enhancement, and a depression, and its change."""

MEANINGS: Final = 32
"""Latents that mean anything to `meant`: those of the default in their order, then three of a depression."""

_f = np.float32
_NIL, _HALF, _ONE, _TWO = _f(0.0), _f(0.5), _f(1.0), _f(2.0)
_ROOT_HALF, _LEAST_RUN, _LEAST_DENSITY, _NEVER = _f(math.sqrt(0.5)), _f(1e-12), _f(1e-30), _f(-1e30)
_MOST_ONSET, _INFINITE = _f(MOST_ONSET), _f(math.inf)
_INTENSITY, _ENHANCEMENT, _SCALE = ChangeKind.INTENSITY, ChangeKind.ENHANCEMENT, ChangeKind.SCALE
_INTENSITY_PCT, _FADING = _f(INTENSITY_PCT), _f(FADING)
_ALL_OR_NONE, _RECTIFIED, _RECRUITMENT = NoiseKind.ALL_OR_NONE, NoiseKind.RECTIFIED, NoiseKind.RECRUITMENT


class Tables(NamedTuple):
    """What kernels know of a model's prior and of its moves."""

    at: IntArray  # of the latent of each of `MEANINGS`; d where the model has none, (m,)
    spreads: FloatArray  # usual SD of each latent, (d,)
    first: IntArray  # latent of each block, (k,)
    size: IntArray  # how many latents it has, (k,)
    components: IntArray  # of its mixture, (k,); 0 for a start, -1 for start and width that may be those of a place
    log_shares: FloatArray  # of the components, less the logs of their SDs, (k, c)
    below: FloatArray  # sums of the shares of earlier components, from the second on, (k, c)
    means: FloatArray  # of the latents in each component, (c, d)
    sds: FloatArray  # likewise, (c, d)
    per_sds: FloatArray  # 1 / SD, as dividers are slow, (c, d)
    start_ms: FloatArray  # knots of the density of a start, evenly spaced, (s,)
    density: FloatArray  # at the knots, (s,)
    quantiles: FloatArray  # probability of an earlier start, at the knots, (s,)
    places: FloatArray  # log share less the logs of the SDs, mean and SD of the start, then of the log width, (l, 5)
    place_share: float  # probability of all places
    place_below: FloatArray  # given that, sums of the shares of earlier places, (l,)
    apart: bool  # enhancement and depression may not overlap
    states: IntArray  # weights of the kinds in the number of a particle's state, (k,)
    shifted: Any  # which latents a difference moves, by state and part, (states, parts, d)
    touched: Any  # which blocks these are of, (states, parts, k)
    parts: FloatArray  # sums of the probabilities of earlier parts, (parts - 1,)
    jumps: FloatArray  # likewise of earlier jumps, (jumps - 1,)
    redrawn: Any  # which latents each jump draws again, (jumps, d)
    renewed: Any  # which kinds each jump draws again, (jumps, k)
    of_profile: Any  # the jump concerns nothing but a profile, which without facilitation means nothing, (jumps,)
    kinds: FloatArray  # sums of the probabilities of earlier values of each kind, (k, v - 1)
    changed: int  # block of the latent that says when something changes; that of its size is the next


@loop
def meant(z: Any, kinds: Any, at: Any, particle: Any) -> None:
    """Write what latents mean, as `Prior.person` says."""
    shape, noise, present, depressed = kinds[0], kinds[1], kinds[2], kinds[3]
    particle[field.SHAPE], particle[field.NOISE], particle[field.PRESENT] = _f(shape), _f(noise), _f(present)
    particle[field.START], particle[field.WIDTH] = z[at[0]], exp(z[at[1]])
    particle[field.FORM] = _f(math.erf(z[at[2]] * _ROOT_HALF)) if shape else _NIL
    particle[field.LOG_FLOOR], particle[field.FLOOR_SD] = z[at[3]], exp(z[at[4]])
    particle[field.DRIFT], particle[field.STARTLED] = z[at[5]], z[at[6]]
    switches, rectified = noise == _ALL_OR_NONE, noise == _RECTIFIED
    particle[field.MOST], particle[field.LEAST] = _ONE, _NIL
    particle[field.ONSET], particle[field.BOOST], particle[field.REST], particle[field.SLOPE] = _NIL, _NIL, _NIL, _NIL
    if rectified or noise == _RECRUITMENT:
        first = 20 if rectified else 14
        slope = exp(z[at[first + 1]])
        particle[field.LOG_RATIO], particle[field.SPREAD] = z[at[first]], exp(z[at[first + 2]])
        particle[field.OUTPUT_SD], particle[field.SLOPE] = exp(z[at[first + 3]]), slope
        particle[field.BOOST], particle[field.REST] = slope * exp(z[at[first + 4]]), slope * z[at[first + 5]]
        if rectified:
            onset = min(exp(z[at[26]]), _MOST_ONSET)
            particle[field.ONSET] = onset
            particle[field.REST] += log(onset) - log(_ONE - onset)
    else:
        particle[field.LOG_RATIO] = z[at[12 if switches else 7]]
        particle[field.SPREAD], particle[field.OUTPUT_SD] = exp(z[at[13 if switches else 8]]), _ONE
        particle[field.MOST] = _ONE / (_ONE + exp(-z[at[10 if switches else 9]]))
        particle[field.LEAST] = _ONE / (_ONE + exp(-z[at[11]]))
    particle[field.LOW_START], particle[field.LOW_WIDTH], particle[field.DEPTH] = _NIL, _ONE, _NIL
    if depressed:
        particle[field.LOW_START], particle[field.LOW_WIDTH] = z[at[29]], exp(z[at[30]])
        particle[field.DEPTH] = exp(z[at[31]] - z[at[18]])
    change, size = kinds[4], z[at[28]]
    particle[field.CHANGED], particle[field.STEP], particle[field.STEP_DRIVE] = exp(z[at[27]]), _NIL, _NIL
    particle[field.FADING], particle[field.STEP_SCALE] = _NIL, _NIL
    if change == _ENHANCEMENT:
        particle[field.FADING] = _FADING * size
    elif change == _SCALE:
        particle[field.STEP_SCALE] = size
    elif change == _INTENSITY and particle[field.SLOPE] > _NIL:
        particle[field.STEP_DRIVE] = particle[field.SLOPE] * _INTENSITY_PCT * size
    elif change:
        particle[field.STEP] = size


@loop
def _start_density(x: Any, start_ms: Any, density: Any) -> Any:
    """Density of a start, 0 where none can be; straight between the knots."""
    last = len(start_ms) - 1
    if not start_ms[0] <= x <= start_ms[last]:
        return _NIL
    place = (x - start_ms[0]) * (_f(last) / (start_ms[last] - start_ms[0]))
    left = min(int(place), last - 1)
    share = place - _f(left)
    return max(density[left] + share * (density[left + 1] - density[left]), _LEAST_DENSITY)


@loop
def _start_at(quantile: Any, start_ms: Any, quantiles: Any) -> Any:
    """The start at a quantile of the prior [ms]."""
    low, high = 0, len(quantiles) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if quantiles[middle] < quantile:
            low = middle
        else:
            high = middle
    share = (quantile - quantiles[low]) / max(quantiles[high] - quantiles[low], _LEAST_RUN)
    return start_ms[low] + min(max(share, _NIL), _ONE) * (start_ms[high] - start_ms[low])


@loop
def _log_sum(parts: Any, count: int) -> Any:
    """Log of the sum of the exponentials of the first parts."""
    most = parts[0]
    for k in range(1, count):
        most = max(most, parts[k])
    summed = _NIL
    for k in range(count):
        summed += exp(parts[k] - most)
    return most + log(summed)


@loop
def log_line(x: Any, log_shares: Any, means: Any, sds: Any) -> Any:
    """Log density of a mixture of one latent but for a constant; a component that is missing has no share."""
    most, summed = _NEVER, _NIL
    for k in range(len(means)):
        distance = (x - means[k]) / sds[k]
        most = max(most, log_shares[k] - _HALF * distance * distance)
    for k in range(len(means)):
        distance = (x - means[k]) / sds[k]
        summed += exp(log_shares[k] - _HALF * distance * distance - most)
    return most + log(summed)


@part
def log_block(z: Any, block: int, tables: Any, parts: Any) -> Any:
    """Log density of the latents of a block but for a constant; -inf where there can be none."""
    first, size, components = tables.first[block], tables.size[block], tables.components[block]
    anywhere, places = _NIL, 0
    if components <= 0:
        density = _start_density(z[first], tables.start_ms, tables.density)
        anywhere = _NEVER if density == _NIL else log(density)
        first, size = first + 1, 1 if components < 0 else 0
        places = len(tables.places) if components < 0 else 0
    count = max(components, -components)
    for k in range(count):
        squares = _NIL
        for latent in range(first, first + size):
            distance = (z[latent] - tables.means[k, latent]) * tables.per_sds[k, latent]
            squares += distance * distance
        parts[k] = tables.log_shares[block, k] - _HALF * squares + anywhere
    for place in range(places):
        law = tables.places[place]
        a, b = (z[0] - law[1]) / law[2], (z[1] - law[3]) / law[4]
        parts[count + place] = law[0] - _HALF * (a * a + b * b)
    if count + places == 0:
        parts[0] = anywhere
    found = parts[0] if count + places < 2 else _log_sum(parts, count + places)
    return found if found > _NEVER * _HALF else -_INFINITE


@loop
def which(quantile: Any, edges: Any) -> int:
    """Which of some alternatives is drawn, by the sums of the probabilities of earlier ones."""
    drawn = 0
    for number in range(len(edges)):
        drawn += quantile > edges[number]
    return drawn


@part
def fresh_values(block: int, tables: Any, dice: Any, z: Any) -> None:
    """Draw the latents of a block from the prior."""
    first, size, components = tables.first[block], tables.size[block], tables.components[block]
    in_place = components < 0 and uniform(dice) < tables.place_share
    if in_place:
        place, quantile = 0, uniform(dice)
        while place < len(tables.places) - 1 and quantile > tables.place_below[place]:
            place += 1
        law = tables.places[place]
        z[0], z[1] = law[1] + law[2] * normal(dice), law[3] + law[4] * normal(dice)
    else:
        if components <= 0:
            z[first] = _start_at(uniform(dice), tables.start_ms, tables.quantiles)
            first, size = first + 1, size - 1
        component = which(uniform(dice), tables.below[block])
        for latent in range(first, first + size):
            z[latent] = tables.means[component, latent] + tables.sds[component, latent] * normal(dice)
