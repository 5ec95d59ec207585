"""The likelihood of a history under particles, trial by trial: the mixture of `noise.log_likelihood` in loops.

The innermost loops run over trials, which are padded to whole lanes, so that they become vector instructions.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from isiw.compiled import bell, exp, inlined, kernel, log, loop, ndtr, per, per_root, total
from isiw.models.particles import noise
from isiw.models.particles.kernels import records as field
from isiw.models.particles.kernels.profile import facilitations
from isiw.models.particles.kernels.records import enhancement_after
from isiw.models.particles.noise import NODES, NoiseKind
from isiw.models.shared.tables import FACTOR_NODES, FIRST_GROUP_MS, GROUPS, ISI_GROUP_MS, ISI_NODES
from isiw.types import FloatArray

_OF_TRIALS: Final = 11
_OF_NODES: Final = _OF_TRIALS + len(FACTOR_NODES)
_ROWS: Final = _OF_NODES + 3
"""Rows of numbers that the likelihood of a history needs in between: of trials, then of the groups of trials that share
a factor, then of the nodes."""

_f = np.float32
_NIL, _HALF, _ONE, _TWO = _f(0.0), _f(0.5), _f(1.0), _f(2.0)
_REACH: Final = noise.NODE_REACH * noise.ON_NODES
NODES_AT: Final = np.linspace(-_REACH, _REACH, NODES).astype(np.float32)
_DENSITY: Final = np.exp(-0.5 * (NODES_AT.astype(np.float64) / noise.ON_NODES) ** 2)
NODE_WEIGHTS: Final = (_DENSITY / _DENSITY.sum()).astype(np.float32)
_SHIFTS: Final = np.array([shift for shift, _ in ISI_NODES], dtype=np.float32)
_SHARES: Final = np.array([weight for _, weight in ISI_NODES], dtype=np.float32)
_BETWEEN, _FAR = _f(noise.BETWEEN_NODES), _f(noise.FAR_BELOW)
_CORNER, _STEEPEST = _f(noise.CORNER), _f(noise.STEEPEST_ROOT)
_MISSING, _ALL_OR_NONE = _f(NoiseKind.MISSING), _f(NoiseKind.ALL_OR_NONE)
_RECRUITMENT, _RECTIFIED = _f(NoiseKind.RECRUITMENT), _f(NoiseKind.RECTIFIED)
_LEAST_SIZE, _LEAST_REACH, _LEAST_MASS = _f(1e-9), _f(1e-12), _f(noise.LEAST_MASS)
_ROOT = _f(1.0 / math.sqrt(2.0 * math.pi))
_OUT_LOW, _OUT_HIGH = _f(noise.OUTLIER_LOG_RANGE[0]), _f(noise.OUTLIER_LOG_RANGE[1])
_OUT_DENSITY = _f(1.0 / (noise.OUTLIER_LOG_RANGE[1] - noise.OUTLIER_LOG_RANGE[0]))
_OUT, _IN = _f(noise.OUTLIER_PROBABILITY), _f(1.0 - noise.OUTLIER_PROBABILITY)
_TINY, _EVER = _f(1e-6), _f(40.0)
_FACTORS_AT: Final = np.array([at for at, _ in FACTOR_NODES], dtype=np.float32)
_FIRST_MS, _GROUP_MS = _f(FIRST_GROUP_MS), _f(ISI_GROUP_MS)
_FACTOR_SHARES: Final = np.array([share for _, share in FACTOR_NODES])


def room_for(records: FloatArray) -> FloatArray:
    """Room for what the likelihood of some records of trials needs in between; see `trial_records`."""
    return np.zeros((_ROWS, max(records.shape[-1], GROUPS, NODES)), dtype=np.float32)


@loop
def is_curved(particle: Any) -> Any:
    """Whether a particle has a recruitment curve, with a threshold or without."""
    return particle[field.NOISE] == _RECRUITMENT or particle[field.NOISE] == _RECTIFIED


@loop
def curve_of(particle: Any, spread: Any, between: Any, room: Any) -> None:
    """Write the noise on a particle's input at each node, and the variance of what lies between; see `noise._curve`."""
    width = particle[field.SPREAD]
    if is_curved(particle):
        for q in range(NODES):
            spread[q] = width * NODES_AT[q]
            between[q] = (_BETWEEN * width) * (_BETWEEN * width)
        return
    nodes = len(spread)  # not a constant to the compiler, which would unroll these loops instead of making vectors
    for q in range(nodes):
        root = _ONE - width * width / _f(9.0) + NODES_AT[q] * width / _f(3.0)
        slope = _BETWEEN * width / max(root, _STEEPEST)
        spread[q] = _f(3.0) * log(max(root, _f(0.02)))
        between[q] = slope * slope
    for q in range(nodes):
        room[q] = NODE_WEIGHTS[q] * exp(spread[q] + _HALF * between[q])
    shift = log(total(room, nodes)) + _FAR
    for q in range(nodes):
        spread[q] -= shift


@loop
def _step(trials: Any, count: int, after: Any, size: Any, added_to: Any) -> None:
    """Add a step to the trials that come after it."""
    if size != _NIL:
        number = trials[field.NUMBER]
        for i in range(count):
            added_to[i] += size if number[i] >= after else _NIL


@loop
def _fade(particle: Any, trials: Any, count: int, level: Any) -> None:
    """Let the facilitation fade or grow from trial to trial."""
    fading = particle[field.FADING]
    if fading != _NIL:
        number = trials[field.NUMBER]
        for i in range(count):
            level[i] *= enhancement_after(fading, number[i])


@loop
def _known(particle: Any, trials: Any, count: int, factor_at: Any, known: Any, varies: Any) -> None:
    """Write the known part of each trial's amplitude, in floors, and its variance."""
    told, told_sd, per_floor = trials[field.KNOWN], trials[field.KNOWN_SD], exp(-particle[field.LOG_FLOOR])
    for i in range(count):
        known[i] = told[i] * per_floor
    for i in range(count):
        varies[i] = told_sd[i] * per_floor * (told_sd[i] * per_floor)
    if factor_at != _NIL:
        log_sd = trials[field.KNOWN_LOG_SD]
        for i in range(count):
            known[i] *= exp(factor_at * log_sd[i])
        for i in range(count):
            varies[i] *= exp(_TWO * factor_at * log_sd[i])
    if particle[field.STEP_SCALE] != _NIL:
        number, after, per_step = trials[field.NUMBER], particle[field.CHANGED], exp(-particle[field.STEP_SCALE])
        for i in range(count):
            known[i] *= per_step if number[i] >= after else _ONE
        for i in range(count):
            varies[i] *= per_step * per_step if number[i] >= after else _ONE


@loop
def _gains(particle: Any, trials: Any, count: int, factor_at: Any, work: Any) -> None:
    """Write the scale of each trial, and the known part of its amplitude; arguments as for `_inputs`."""
    scale = work[2]
    startle, relaxed, offset = trials[field.STARTLE], trials[field.RELAXED], trials[field.OFFSET]
    log_scale = particle[field.LOG_RATIO] + (_NIL if is_curved(particle) else _FAR)
    drift, startled = particle[field.DRIFT], particle[field.STARTLED]
    # Few arrays a loop, or the compiler gives up on proving that they do not overlap.
    for i in range(count):
        scale[i] = log_scale + drift * relaxed[i] + startled * startle[i] + offset[i]
    _step(trials, count, particle[field.CHANGED], particle[field.STEP], scale)
    for i in range(count):
        scale[i] = exp(scale[i])
    _known(particle, trials, count, factor_at, work[4], work[5])


@loop
def _inputs(particle: Any, trials: Any, count: int, node: Any, work: Any) -> None:
    """Write what the nodes of each trial have in common: drive, scale, and the probability of a response."""
    level, drive, responds = work[0], work[1], work[3]
    isi, isi_sd, factor, shift = trials[field.ISI], trials[field.ISI_SD], trials[field.FACTOR], trials[field.SHIFT]
    for i in range(count):
        drive[i] = isi[i] + node * isi_sd[i]
    facilitations(particle, drive, level, count)
    for i in range(count):
        level[i] *= factor[i]
        responds[i] = _ONE
    _fade(particle, trials, count, level)
    most, least, kind = particle[field.MOST], particle[field.LEAST], particle[field.NOISE]
    if is_curved(particle):
        rest, boost, slope = particle[field.REST], particle[field.BOOST], particle[field.SLOPE]
        for i in range(count):
            drive[i] = rest + boost * level[i] + slope * shift[i]
        _step(trials, count, particle[field.CHANGED], particle[field.STEP_DRIVE], drive)
    elif kind == _ALL_OR_NONE:
        for i in range(count):
            drive[i] = _NIL
            responds[i] = least + (most - least) * level[i]
    else:
        for i in range(count):
            drive[i] = log(max(level[i], _LEAST_SIZE))
            responds[i] = most * math.sqrt(level[i]) if kind == _MISSING else _ONE


@inlined
def _sigmoid(drive: Any) -> Any:
    return per(_ONE + exp(-drive))


@inlined
def _share(sigmoid: Any, between: Any, scale: Any, start: Any) -> Any:
    """The evoked part of a mean at a node, in floors, and its relative variance; no threshold is None."""
    flat = _ONE - sigmoid
    if start is None:
        return sigmoid * scale, flat * flat * between
    steep, over = sigmoid * flat, sigmoid - start
    variance = steep * steep * between
    reach = max(over * over + _CORNER * variance, _LEAST_REACH)
    return (math.sqrt(reach) + over) * (_HALF / (_ONE - start)) * scale, variance / reach


@inlined
def _inverse_sd(share: Any, variance: Any, of_trial: Any) -> Any:
    _, _, known, _, floor_variance, output = of_trial
    return (_ONE + share + known) * per_root(share * share * (variance + output) + floor_variance)


@inlined
def _normal(share: Any, inverse_sd: Any, of_trial: Any) -> Any:
    """Density of a log MEP by the evoked part of its mean, in floors, and the inverse of its SD, but for a constant."""
    _, _, known, relative, _, _ = of_trial
    return inverse_sd * bell((log(_ONE + share + known) - relative) * inverse_sd)


@inlined
def _four_nodes(nodes: Any, start: Any, of_trial: Any) -> Any:
    """The part of the density that four nodes add; each step for all of them, as the next waits for its outcome."""
    (at, between, w), (drive, scale, _, _, _, _) = nodes, of_trial
    a, b, c, d = _sigmoid(drive + at[0]), _sigmoid(drive + at[1]), _sigmoid(drive + at[2]), _sigmoid(drive + at[3])
    (a, of_a), (b, of_b) = _share(a, between[0], scale, start), _share(b, between[1], scale, start)
    (c, of_c), (d, of_d) = _share(c, between[2], scale, start), _share(d, between[3], scale, start)
    of_a, of_b = _inverse_sd(a, of_a, of_trial), _inverse_sd(b, of_b, of_trial)
    of_c, of_d = _inverse_sd(c, of_c, of_trial), _inverse_sd(d, of_d, of_trial)
    first = w[0] * _normal(a, of_a, of_trial) + w[1] * _normal(b, of_b, of_trial)
    return first + (w[2] * _normal(c, of_c, of_trial) + w[3] * _normal(d, of_d, of_trial))


@loop
def _density(particle: Any, trials: Any, count: int, curve: Any, work: Any, likelihood: Any) -> None:
    """Write the density of each trial's log MEP, shape (n,)."""
    drive, scale, responds, known, varies = work[1], work[2], work[3], work[4], work[5]
    relative, evoked = work[6], work[7]
    low, floor = trials[field.LOW], particle[field.LOG_FLOOR]
    floor_variance, start = particle[field.FLOOR_SD] * particle[field.FLOOR_SD], particle[field.ONSET]
    output = particle[field.OUTPUT_SD] * particle[field.OUTPUT_SD] if is_curved(particle) else _NIL
    for i in range(count):
        relative[i] = low[i] - floor
    _step(trials, count, particle[field.CHANGED], -particle[field.STEP_SCALE], relative)
    # All nodes in one pass, so that no sums go through memory; `_inside` has the same as a loop over `NODES`.
    # The nodes are handed over as parts of arrays: Numba compiles a function anew for each number in a call.
    first = curve[0, :4], curve[1, :4], NODE_WEIGHTS[:4]
    second = curve[0, 4:NODES], curve[1, 4:NODES], NODE_WEIGHTS[4:]
    if start > _NIL:
        for i in range(count):
            one = drive[i], scale[i], known[i], relative[i], floor_variance + varies[i], output
            evoked[i] = _four_nodes(first, start, one) + _four_nodes(second, start, one)
    else:
        for i in range(count):
            one = drive[i], scale[i], known[i], relative[i], floor_variance + varies[i], output
            evoked[i] = _four_nodes(first, None, one) + _four_nodes(second, None, one)
    for i in range(count):
        still = (_ONE + known[i]) * per_root(floor_variance + varies[i])
        silent = still * bell((log(_ONE + known[i]) - relative[i]) * still)
        outlier = (_OUT_DENSITY if _OUT_LOW < relative[i] < _OUT_HIGH else _NIL) + _TINY
        density = _ROOT * (responds[i] * evoked[i] + (_ONE - responds[i]) * silent)
        likelihood[i] = _IN * density + _OUT * outlier


@loop
def _between(low: Any, high: Any) -> Any:
    """Probability that a standard normal variable is between two ends, exact in either tail down to 1e-18.

    That is far below `noise.LEAST_MASS`, and no logarithm is taken of less.
    """
    right = low > _NIL
    return ndtr(-low if right else high) - ndtr(-high if right else low)


@loop
def _inside(particle: Any, trials: Any, count: int, curve: Any, work: Any, likelihood: Any) -> None:
    """Write the probability that each trial's log MEP is between its ends; arguments as for `_density`."""
    drive, scale, responds, known, varies = work[1], work[2], work[3], work[4], work[5]
    low, high, evoked = work[6], work[7], work[8]
    told_low, told_high, floor = trials[field.LOW], trials[field.HIGH], particle[field.LOG_FLOOR]
    floor_variance = particle[field.FLOOR_SD] * particle[field.FLOOR_SD]
    output = particle[field.OUTPUT_SD] * particle[field.OUTPUT_SD] if is_curved(particle) else _NIL
    start = particle[field.ONSET]
    rectified, rescaled = start > _NIL, _HALF / (_ONE - start)
    for i in range(count):  # a power of 40 stands in for infinity
        low[i] = max(told_low[i], -_EVER) - floor
    for i in range(count):
        high[i] = min(told_high[i], _EVER) - floor
        evoked[i] = _NIL
    _step(trials, count, particle[field.CHANGED], -particle[field.STEP_SCALE], low)
    _step(trials, count, particle[field.CHANGED], -particle[field.STEP_SCALE], high)
    for q in range(NODES):
        at, between, weight = curve[0, q], curve[1, q], NODE_WEIGHTS[q]
        for i in range(count):
            sigmoid = per(_ONE + exp(-(drive[i] + at)))
            flat = _ONE - sigmoid
            variance = sigmoid * flat * (sigmoid * flat) * between
            over = sigmoid - start
            reach = max(over * over + _CORNER * variance, _LEAST_REACH)
            share = scale[i] * ((math.sqrt(reach) + over) * rescaled if rectified else sigmoid)
            varied = share * share * ((variance / reach if rectified else flat * flat * between) + output)
            total = _ONE + share + known[i]
            inverse_sd, mean = total * per_root(varied + floor_variance + varies[i]), log(total)
            evoked[i] += weight * _between((low[i] - mean) * inverse_sd, (high[i] - mean) * inverse_sd)
    for i in range(count):
        still, mean = (_ONE + known[i]) / math.sqrt(floor_variance + varies[i]), log(_ONE + known[i])
        silent = _between((low[i] - mean) * still, (high[i] - mean) * still)
        first = min(max((low[i] - _OUT_LOW) * _OUT_DENSITY, _NIL), _ONE)
        outlier = min(max((high[i] - _OUT_LOW) * _OUT_DENSITY, _NIL), _ONE) - first
        mixed = responds[i] * evoked[i] + (_ONE - responds[i]) * silent
        likelihood[i] = max(_IN * mixed + _OUT * outlier, _LEAST_MASS)


@loop
def _by_trial(particle: Any, trials: Any, count: int, censored: Any, factor_at: Any, curve: Any, work: Any) -> None:
    """Write the log likelihood of each trial of a piece of one sort, at a node of the factor of known parts."""
    real, isi_sd, likelihood, summed = trials[field.REAL], trials[field.ISI_SD], work[9], work[10]
    uncertain = False
    for i in range(count):
        uncertain |= isi_sd[i] > _NIL
        summed[i] = _NIL
    _gains(particle, trials, count, factor_at, work)
    for node in range(3 if uncertain else 1):
        _inputs(particle, trials, count, _SHIFTS[node] if uncertain else _NIL, work)
        if censored:
            _inside(particle, trials, count, curve, work, likelihood)
        else:
            _density(particle, trials, count, curve, work, likelihood)
        share = _SHARES[node] if uncertain else _ONE
        for i in range(count):
            summed[i] += share * likelihood[i]
    for i in range(count):
        summed[i] = real[i] * log(summed[i])


@loop
def _group_of(isi_ms: Any) -> int:
    """The group of trials that an ISI belongs to; see `ISI_GROUP_MS`."""
    return min(max(int((isi_ms - _FIRST_MS) / _GROUP_MS), 0), GROUPS - 1)


@loop
def _averaged(groups: Any) -> float:
    """Log likelihood of a history from that of each group of trials at each node of the factor of known parts."""
    summed = 0.0
    for group in range(GROUPS):
        most, least, mixed = -math.inf, math.inf, 0.0
        for node in range(len(_FACTORS_AT)):
            most, least = max(most, groups[node, group]), min(least, groups[node, group])
        if least < most:
            for node in range(len(_FACTORS_AT)):
                mixed += _FACTOR_SHARES[node] * math.exp(groups[node, group] - most)
            most += math.log(mixed)
        summed += most
    return summed


@loop
def history_likelihood(particle: Any, records: Any, sizes: Any, room: Any) -> float:
    """Log likelihood of one person's history under a particle; see `trial_records`."""
    curve, nodes, groups = room[_OF_NODES:], NODES, room[_OF_TRIALS:_OF_NODES]
    curve_of(particle, curve[0, :nodes], curve[1, :nodes], curve[2])
    shares, summed = sizes[field.SHARES, 0], 0.0
    if shares:
        groups[:, :GROUPS] = _NIL
    for node in range(len(_FACTORS_AT) if shares else 1):
        for sort in range(2):
            for piece in range(sizes.shape[1]):
                trials, count = records[sort, piece], sizes[sort, piece]
                if count:
                    at = _FACTORS_AT[node] if shares else _NIL
                    _by_trial(particle, trials, count, sort == 1, at, curve, room)
                    summed += total(room[10], count)
                for i in range(count if shares else 0):
                    groups[node, _group_of(trials[field.ISI, i])] += room[10, i]
    return _averaged(groups) if shares else summed


@kernel
def likelihoods(particles: Any, records: Any, sizes: Any, room: Any, found: Any) -> None:
    """Write the log likelihood of each person's history under each particle, shape (b, p)."""
    for person in range(particles.shape[0]):
        for i in range(particles.shape[1]):
            found[person, i] = history_likelihood(particles[person, i], records[person], sizes[person], room)
