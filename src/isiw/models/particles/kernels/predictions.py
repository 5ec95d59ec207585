"""Predictive distributions and expected MEPs of particles in loops: what `predictions` says in torch."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from isiw.compiled import LANES, bell, exp, inlined, kernel, log, loop, per, per_root, total
from isiw.models.particles import noise
from isiw.models.particles.kernels import records as field
from isiw.models.particles.kernels.likelihood import NODE_WEIGHTS, NODES_AT, curve_of, is_curved
from isiw.models.particles.kernels.profile import facilitations
from isiw.models.particles.kernels.records import gain_of
from isiw.models.particles.noise import NODES, NoiseKind

_f = np.float32
_NIL, _HALF, _ONE = _f(0.0), _f(0.5), _f(1.0)
_PER_NODE, _FAR, _CORNER = _f(1.0 / noise.ON_NODES), _f(noise.FAR_BELOW), _f(noise.CORNER)
_MISSING, _ALL_OR_NONE = _f(NoiseKind.MISSING), _f(NoiseKind.ALL_OR_NONE)
_LEAST_SIZE, _LEAST_REACH, _TINY = _f(1e-9), _f(1e-12), _f(1e-6)
_ROOT = _f(1.0 / math.sqrt(2.0 * math.pi))
_OUT_LOW, _OUT_HIGH = _f(noise.OUTLIER_LOG_RANGE[0]), _f(noise.OUTLIER_LOG_RANGE[1])
_OUT_DENSITY = _f(1.0 / (noise.OUTLIER_LOG_RANGE[1] - noise.OUTLIER_LOG_RANGE[0]))
_OUT, _IN = _f(noise.OUTLIER_PROBABILITY), _f(1.0 - noise.OUTLIER_PROBABILITY)


def table_rows(particles: Any, rows: int) -> Any:
    """Facilitations of the tables' rows, shape (b, s, l): squares of equal steps, or equal steps from below 0."""
    levels = np.empty((*particles.shape[:2], rows), np.float32)
    _table_rows(particles, levels)
    return levels


@kernel
def _table_rows(particles: Any, levels: Any) -> None:
    people, size, rows = levels.shape
    for person in range(people):
        for i in range(size):
            depth = particles[person, i, field.DEPTH]
            for row in range(rows):
                share = _f(row) / _f(rows - 1)
                levels[person, i, row] = share * (_ONE + depth) - depth if depth > _NIL else share * share


@loop
def _responds(particle: Any, level: Any) -> Any:
    """Probability of a response at a facilitation."""
    kind, most, least = particle[field.NOISE], particle[field.MOST], particle[field.LEAST]
    if kind == _MISSING:
        return most * math.sqrt(level)
    return least + (most - least) * level if kind == _ALL_OR_NONE else _ONE


@loop
def _evoked(particle: Any, levels: Any, means: Any) -> None:
    """Write the expected MEP above the floor at some facilitations, in floors; see `noise.evoked_mean`."""
    count, ratio = len(levels), exp(particle[field.LOG_RATIO])
    for row in range(count):
        means[row] = _NIL
    if is_curved(particle):
        rest, boost, start = particle[field.REST], particle[field.BOOST], particle[field.ONSET]
        for q in range(NODES):
            at, weight = rest + particle[field.SPREAD] * NODES_AT[q] * _PER_NODE, NODE_WEIGHTS[q]
            for row in range(count):
                share = per(_ONE + exp(-(at + boost * levels[row])))
                means[row] += weight * max(share - start, _NIL)
        ratio *= exp(_HALF * particle[field.OUTPUT_SD] * particle[field.OUTPUT_SD]) / (_ONE - start)
    else:
        whole = particle[field.NOISE] == _ALL_OR_NONE
        for row in range(count):
            means[row] = _ONE if whole else levels[row]
    for row in range(count):
        means[row] *= ratio * _responds(particle, max(levels[row], _NIL))


def evoked_means(particles: Any, levels: Any) -> Any:
    """Expected MEP above the floor, in floors, shape (b, s, l)."""
    means = np.empty(levels.shape, np.float32)
    _evoked_means(particles, levels, means)
    return means


@kernel
def _evoked_means(particles: Any, levels: Any, means: Any) -> None:
    for person in range(particles.shape[0]):
        for i in range(particles.shape[1]):
            _evoked(particles[person, i], levels[person, i], means[person, i])


@loop
def _components(particle: Any, drive: Any, scale: Any, at: Any, between: Any, mean: Any, inverse_sd: Any) -> None:
    """Write mean and inverse SD of the log MEP over the floor at one node, by the drive; see `noise._components`."""
    curved, start, floor_sd = is_curved(particle), particle[field.ONSET], particle[field.FLOOR_SD]
    output = particle[field.OUTPUT_SD] * particle[field.OUTPUT_SD] if curved else _NIL
    floor_variance, rescaled, rectified = floor_sd * floor_sd, _HALF / (_ONE - start), start > _NIL
    for row in range(len(drive)):
        share = per(_ONE + exp(-(drive[row] + at)))
        flat = _ONE - share
        variance = share * flat * (share * flat) * between
        over = share - start
        reach = max(over * over + _CORNER * variance, _LEAST_REACH)
        size = scale * ((math.sqrt(reach) + over) * rescaled if rectified else share)
        varied = (variance / reach if rectified else flat * flat * between) + output
        inverse_sd[row] = (_ONE + size) * per_root(size * size * varied + floor_variance)
        mean[row] = log(_ONE + size)


@inlined
def _node(over: Any, mean: Any, inverse_sd: Any, weight: Any) -> Any:
    """The part of the density of a log MEP over the floor that one node adds, but for a constant."""
    return weight * inverse_sd * bell((over - mean) * inverse_sd)


@loop
def _outcomes(particle: Any, levels: Any, gain: Any, lines: Any, nodes: Any, table: Any) -> None:
    """Write the probability of each outcome at some facilitations, shape (l, y)."""
    relative, width, drive, cell, spread, between = lines[0], lines[1], lines[2], lines[3], lines[4], lines[5]
    mean, inverse_sd, w = nodes[0], nodes[1], NODE_WEIGHTS
    rows, count = len(levels), lines.shape[1]
    curve_of(particle, spread[:NODES], between[:NODES], cell)
    curved, per_sd, floor = is_curved(particle), _ONE / particle[field.FLOOR_SD], particle[field.LOG_FLOOR]
    scale = exp(particle[field.LOG_RATIO] + gain + (_NIL if curved else _FAR))
    rest, boost, whole = particle[field.REST], particle[field.BOOST], particle[field.NOISE] == _ALL_OR_NONE
    for row in range(rows):
        if curved:
            drive[row] = rest + boost * levels[row]
        else:
            drive[row] = _NIL if whole else log(max(levels[row], _LEAST_SIZE))
    for q in range(NODES):
        _components(particle, drive, scale, spread[q], between[q], mean[q], inverse_sd[q])
    for row in range(rows):
        responds, at, per = _responds(particle, max(levels[row], _NIL)), mean[:, row], inverse_sd[:, row]
        for y in range(count):
            over = relative[y] - floor
            # All nodes in one pass, as for the likelihood.
            first = _node(over, at[0], per[0], w[0]) + _node(over, at[1], per[1], w[1])
            second = _node(over, at[2], per[2], w[2]) + _node(over, at[3], per[3], w[3])
            third = _node(over, at[4], per[4], w[4]) + _node(over, at[5], per[5], w[5])
            fourth = _node(over, at[6], per[6], w[6]) + _node(over, at[7], per[7], w[7])
            evoked = first + second + (third + fourth)
            outlier = (_OUT_DENSITY if _OUT_LOW < over < _OUT_HIGH else _NIL) + _TINY
            density = _ROOT * (responds * evoked + (_ONE - responds) * (per_sd * bell(over * per_sd)))
            cell[y] = (_IN * density + _OUT * outlier) * width[y]
        per_sum = _ONE / total(cell, count)
        for y in range(table.shape[1]):
            table[row, y] = cell[y] * per_sum


def outcome_tables(particles: Any, levels: Any, order: int, log_mep: Any, width: Any, table: Any) -> None:
    """Write the probability of each outcome of the next trial at some facilitations, shape (b, s, l, y)."""
    padded = (max(log_mep.shape[1], levels.shape[2], NODES) + LANES - 1) // LANES * LANES
    lines, nodes = np.zeros((6, padded), np.float32), np.empty((2, NODES, padded), np.float32)
    lines[1, : len(width)] = width
    _outcome_tables(particles, levels, order, log_mep, lines, nodes, table)


@kernel
def _outcome_tables(particles: Any, levels: Any, order: int, log_mep: Any, lines: Any, nodes: Any, table: Any) -> None:
    startle, relaxed = gain_of(order)
    for person in range(levels.shape[0]):
        for y in range(log_mep.shape[1]):
            lines[0, y] = log_mep[person, y]
        for i in range(levels.shape[1]):
            particle = particles[person, i]
            gain = particle[field.DRIFT] * relaxed + particle[field.STARTLED] * startle
            _outcomes(particle, levels[person, i], gain, lines, nodes, table[person, i])


@inlined
def position_of(level: Any, depth: Any, rows: int) -> Any:
    """Where a facilitation lies among the rows of a table."""
    share = (level + depth) / (_ONE + depth) if depth > _NIL else math.sqrt(min(max(level, _NIL), _ONE))
    return min(max(share, _NIL), _ONE) * _f(rows - 1)


@loop
def _between_rows(table: Any, level: Any, depth: Any, found: Any) -> None:
    for t in range(len(level)):
        position = position_of(level[t], depth, table.shape[0])
        row = max(min(int(position), table.shape[0] - 2), 0)  # no number is no row either
        above, first, second, blend = position - _f(row), table[row], table[row + 1], found[t]
        for y in range(table.shape[1]):
            blend[y] = first[y] + above * (second[y] - first[y])


@kernel
def rows_between(particles: Any, table: Any, levels: Any, found: Any) -> None:
    """Write what lies between the rows of a table, shape (b, s, t, y)."""
    for person in range(levels.shape[0]):
        for i in range(levels.shape[1]):
            depth = particles[person, i, field.DEPTH]
            _between_rows(table[person, i], levels[person, i], depth, found[person, i])


def facilitation_rows(particles: Any, isi_ms: Any) -> Any:
    """Facilitation of each particle at some ISIs [ms] (t,), shape (b, s, t)."""
    found = np.empty((*particles.shape[:2], len(isi_ms)), np.float32)
    _facilitation_rows(particles, isi_ms, found)
    return found


@kernel
def _facilitation_rows(particles: Any, isi_ms: Any, found: Any) -> None:
    for person in range(particles.shape[0]):
        for i in range(particles.shape[1]):
            facilitations(particles[person, i], isi_ms, found[person, i], len(isi_ms))
