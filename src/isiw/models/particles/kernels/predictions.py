"""Predictive distributions, expected MEPs and windows of particles in loops: what `predictions` says in torch."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from isiw.compiled import LANES, exp, exp2, inlined, kernel, log, loop, per, per_root, total
from isiw.models.particles.kernels.likelihood import (
    NODE_WEIGHTS,
    NODES_AT,
    curve_of,
    facilitations,
    is_curved,
)
from isiw.models.particles.kernels.records import (
    BOOST,
    DEPTH,
    DRIFT,
    FLOOR_SD,
    FORM,
    LEAST,
    LOG_FLOOR,
    LOG_RATIO,
    MOST,
    NOISE,
    ONSET,
    OUTPUT_SD,
    PRESENT,
    REST,
    SHAPE,
    SPREAD,
    START,
    STARTLED,
    WIDTH,
    gain_of,
)
from isiw.models.particles.noise import (
    CORNER,
    FAR_BELOW,
    NODES,
    ON_NODES,
    OUTLIER_LOG_RANGE,
    OUTLIER_PROBABILITY,
    NoiseKind,
)
from isiw.models.particles.shapes import PEAKS_AT, ShapeKind
from isiw.window import EDGE_LEVEL, MIN_EXCESS_MV, MIN_EXCESS_OF_BASELINE

__all__ = [
    "edge_levels",
    "evoked_means",
    "facilitation_rows",
    "masks_of",
    "outcome_tables",
    "rows_between",
    "table_rows",
    "window_runs",
]

_f = np.float32
_NIL, _HALF, _ONE = _f(0.0), _f(0.5), _f(1.0)
_PER_NODE, _FAR, _CORNER = _f(1.0 / ON_NODES), _f(FAR_BELOW), _f(CORNER)
_PLATEAU, _SKEWED, _TWO_PEAK = (_f(kind) for kind in (ShapeKind.PLATEAU, ShapeKind.SKEWED, ShapeKind.TWO_PEAK))
_MISSING, _ALL_OR_NONE = _f(NoiseKind.MISSING), _f(NoiseKind.ALL_OR_NONE)
_LEAST_SIZE, _LEAST_REACH, _TINY = _f(1e-9), _f(1e-12), _f(1e-6)
_BELL, _END, _ROOT = _f(-0.5 / math.log(2.0)), _f(11.0), _f(1.0 / math.sqrt(2.0 * math.pi))
_OUT_LOW, _OUT_HIGH = _f(OUTLIER_LOG_RANGE[0]), _f(OUTLIER_LOG_RANGE[1])
_OUT_DENSITY = _f(1.0 / (OUTLIER_LOG_RANGE[1] - OUTLIER_LOG_RANGE[0]))
_OUT, _IN = _f(OUTLIER_PROBABILITY), _f(1.0 - OUTLIER_PROBABILITY)
_EDGE, _ENOUGH_MV, _ENOUGH = _f(EDGE_LEVEL), _f(MIN_EXCESS_MV), _f(MIN_EXCESS_OF_BASELINE)
_FIRST_PEAK, _SECOND_PEAK = _f(PEAKS_AT[0]), _f(PEAKS_AT[1])
_NOWHERE: Final = _f(2.0)


@kernel
def table_rows(particles: Any, rows: int) -> Any:
    """Facilitations of the tables' rows, shape (b, s, l): squares of equal steps, or equal steps from below 0."""
    people, size = particles.shape[:2]
    levels = np.empty((people, size, rows), dtype=np.float32)
    for person in range(people):
        for i in range(size):
            depth = particles[person, i, DEPTH]
            for row in range(rows):
                share = _f(row) / _f(rows - 1)
                levels[person, i, row] = share * (_ONE + depth) - depth if depth > _NIL else share * share
    return levels


@loop
def _responds(particle: Any, level: Any) -> Any:
    """Probability of a response at a facilitation."""
    kind, most, least = particle[NOISE], particle[MOST], particle[LEAST]
    if kind == _MISSING:
        return most * math.sqrt(level)
    return least + (most - least) * level if kind == _ALL_OR_NONE else _ONE


@loop
def _evoked(particle: Any, levels: Any, means: Any) -> None:
    """Write the expected MEP above the floor at some facilitations, in floors; see `noise.evoked_mean`."""
    count, ratio = len(levels), exp(particle[LOG_RATIO])
    for row in range(count):
        means[row] = _NIL
    if is_curved(particle):
        rest, boost, start = particle[REST], particle[BOOST], particle[ONSET]
        for q in range(NODES):
            at, weight = rest + particle[SPREAD] * NODES_AT[q] * _PER_NODE, NODE_WEIGHTS[q]
            for row in range(count):
                share = per(_ONE + exp(-(at + boost * levels[row])))
                means[row] += weight * max(share - start, _NIL)
        ratio *= exp(_HALF * particle[OUTPUT_SD] * particle[OUTPUT_SD]) / (_ONE - start)
    else:
        whole = particle[NOISE] == _ALL_OR_NONE
        for row in range(count):
            means[row] = _ONE if whole else levels[row]
    for row in range(count):
        means[row] *= ratio * _responds(particle, max(levels[row], _NIL))


@kernel
def evoked_means(particles: Any, levels: Any) -> Any:
    """Expected MEP above the floor, in floors, shape (b, s, l).

    Args:
        particles: records, shape (b, s, PARTICLE).
        levels: facilitations, shape (b, s, l).
    """
    means = np.empty(levels.shape, dtype=np.float32)
    for person in range(particles.shape[0]):
        for i in range(particles.shape[1]):
            _evoked(particles[person, i], levels[person, i], means[person, i])
    return means


@loop
def _components(particle: Any, drive: Any, scale: Any, at: Any, between: Any, mean: Any, inverse_sd: Any) -> None:
    """Write mean and inverse SD of the log MEP over the floor at one node, by the drive; see `noise._components`."""
    curved, start, floor_sd = is_curved(particle), particle[ONSET], particle[FLOOR_SD]
    output = particle[OUTPUT_SD] * particle[OUTPUT_SD] if curved else _NIL
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


@loop
def _outcomes(particle: Any, levels: Any, gain: Any, lines: Any, cells: Any, table: Any) -> None:
    """Write the probability of each outcome at some facilitations, shape (l, y).

    Args:
        particle: its record.
        levels: the facilitations, shape (l,).
        gain: of the next trial.
        lines: log MEP of each outcome, width of its cell, and five more lines of whole lanes that are free.
        cells: room for as many lines as there are facilitations.
        table: where they are written.
    """
    relative, width, drive, mean, inverse_sd, spread, between = (
        lines[0],
        lines[1],
        lines[2],
        lines[3],
        lines[4],
        lines[5],
        lines[6],
    )
    rows, count = len(levels), lines.shape[1]
    curve_of(particle, spread[:NODES], between[:NODES], mean)
    curved, per_sd, floor = is_curved(particle), _ONE / particle[FLOOR_SD], particle[LOG_FLOOR]
    scale = exp(particle[LOG_RATIO] + gain + (_NIL if curved else _FAR))
    rest, boost, whole = particle[REST], particle[BOOST], particle[NOISE] == _ALL_OR_NONE
    for row in range(rows):
        if curved:
            drive[row] = rest + boost * levels[row]
        else:
            drive[row] = _NIL if whole else log(max(levels[row], _LEAST_SIZE))
        for y in range(count):
            cells[row, y] = _NIL
    for q in range(NODES):
        _components(particle, drive, scale, spread[q], between[q], mean, inverse_sd)
        for row in range(rows):
            cell, at, per, weight = cells[row], mean[row] + floor, inverse_sd[row], NODE_WEIGHTS[q] * inverse_sd[row]
            for y in range(count):
                z = min(max((relative[y] - at) * per, -_END), _END)
                cell[y] += weight * exp2(_BELL * z * z)
    for row in range(rows):
        cell, responds = cells[row], _responds(particle, max(levels[row], _NIL))
        for y in range(count):
            over = relative[y] - floor
            z = min(max(over * per_sd, -_END), _END)
            outlier = (_OUT_DENSITY if _OUT_LOW < over < _OUT_HIGH else _NIL) + _TINY
            density = _ROOT * (responds * cell[y] + (_ONE - responds) * (per_sd * exp2(_BELL * z * z)))
            cell[y] = (_IN * density + _OUT * outlier) * width[y]
        per_sum = _ONE / total(cell, count)
        for y in range(table.shape[1]):
            table[row, y] = cell[y] * per_sum


@kernel
def outcome_tables(particles: Any, levels: Any, order: int, log_mep: Any, width: Any) -> Any:
    """Probability of each outcome of the next trial at some facilitations, shape (b, s, l, y).

    Args:
        particles: records, shape (b, s, PARTICLE).
        levels: facilitations, shape (b, s, l).
        order: how many trials came before.
        log_mep: middles of the outcomes' cells, shape (b, y).
        width: of the cells, up to a constant, shape (y,).
    """
    people, size, rows = levels.shape
    outcomes = log_mep.shape[1]
    padded = (max(outcomes, rows) + LANES - 1) // LANES * LANES
    table, cells = (
        np.empty((people, size, rows, outcomes), dtype=np.float32),
        np.empty((rows, padded), dtype=np.float32),
    )
    lines = np.zeros((7, padded), dtype=np.float32)
    lines[1, :outcomes] = width
    startle, relaxed = gain_of(order)
    for person in range(people):
        lines[0, :outcomes] = log_mep[person]
        for i in range(size):
            particle = particles[person, i]
            gain = particle[DRIFT] * relaxed + particle[STARTLED] * startle
            _outcomes(particle, levels[person, i], gain, lines, cells, table[person, i])
    return table


@inlined
def _position(level: Any, depth: Any, rows: int) -> Any:
    """Where a facilitation lies among the rows of a table."""
    share = (level + depth) / (_ONE + depth) if depth > _NIL else math.sqrt(min(max(level, _NIL), _ONE))
    return min(max(share, _NIL), _ONE) * _f(rows - 1)


@loop
def _between_rows(table: Any, level: Any, depth: Any, found: Any) -> None:
    for t in range(len(level)):
        position = _position(level[t], depth, table.shape[0])
        row = min(int(position), table.shape[0] - 2)
        above, first, second, blend = position - _f(row), table[row], table[row + 1], found[t]
        for y in range(table.shape[1]):
            blend[y] = first[y] + above * (second[y] - first[y])


@kernel
def rows_between(particles: Any, table: Any, levels: Any) -> Any:
    """What lies between the rows of a table, shape (b, s, t, y).

    Args:
        particles: records, shape (b, s, PARTICLE).
        table: a row for each of `table_rows`, shape (b, s, l, y).
        levels: facilitations, shape (b, s, t).
    """
    people, size, count = levels.shape
    found = np.empty((people, size, count, table.shape[3]), dtype=np.float32)
    for person in range(people):
        for i in range(size):
            depth = particles[person, i, DEPTH]
            _between_rows(table[person, i], levels[person, i], depth, found[person, i])
    return found


@kernel
def facilitation_rows(particles: Any, isi_ms: Any) -> Any:
    """Facilitation of each particle at some ISIs [ms] (t,), shape (b, s, t)."""
    people, size = particles.shape[:2]
    found = np.empty((people, size, len(isi_ms)), dtype=np.float32)
    for person in range(people):
        for i in range(size):
            facilitations(particles[person, i], isi_ms, found[person, i], len(isi_ms))
    return found


@loop
def _peak_at(particle: Any) -> Any:
    """Where a profile of one peak has it, as a share of the span."""
    return _HALF + _f(0.33) * particle[FORM] if particle[SHAPE] == _SKEWED else _HALF


@loop
def _highest(particle: Any, isi_ms: Any, fine: Any, room: Any) -> Any:
    """Largest facilitation at some ISIs; where they are close to each other, in all of their range."""
    count = len(isi_ms)
    if fine:
        count, low, high = 3, isi_ms[0], isi_ms[len(isi_ms) - 1]
        at = room[1]
        at[0], at[1], at[2] = _peak_at(particle), _FIRST_PEAK, _SECOND_PEAK
        for i in range(count):
            at[i] = min(max(particle[START] + at[i] * particle[WIDTH], low), high)
        facilitations(particle, at, room[0], count)
    else:
        facilitations(particle, isi_ms, room[0], count)
    most = _NIL
    for i in range(count):
        most = max(most, room[0, i])
    return min(most, _ONE) if fine else most


@loop
def _edge_level(particle: Any, evoked: Any, highest: Any) -> Any:
    """Facilitation at a window's edge by the least-excess rule; 2 where there is no window."""
    rows = len(evoked)
    floor_mv = exp(particle[LOG_FLOOR])
    position = _position(highest, _NIL, rows)
    row = min(int(position), rows - 2)
    peak_mv = floor_mv * (evoked[row] + (position - _f(row)) * (evoked[row + 1] - evoked[row]) - evoked[0])
    baseline_mv = floor_mv * (evoked[0] + exp(_HALF * particle[FLOOR_SD] * particle[FLOOR_SD]))
    if particle[PRESENT] == _NIL or peak_mv < max(_ENOUGH * baseline_mv, _ENOUGH_MV):
        return _NOWHERE
    least_mv, right = _EDGE * peak_mv, 1
    while right < rows - 1 and floor_mv * (evoked[right] - evoked[0]) < least_mv:
        right += 1
    low_mv, high_mv = floor_mv * (evoked[right - 1] - evoked[0]), floor_mv * (evoked[right] - evoked[0])
    place = (_f(right - 1) + (least_mv - low_mv) / max(high_mv - low_mv, _LEAST_REACH)) / _f(rows - 1)
    return place * place


@kernel
def edge_levels(particles: Any, evoked: Any, isi_ms: Any, fine: bool) -> Any:  # noqa: FBT001 - kernels know no keywords
    """Facilitation at each window's edge, shape (b, s); 2 where there is no window.

    Args:
        particles: records, shape (b, s, PARTICLE).
        evoked: expected MEP above the floor at the squares of equal steps, in floors, shape (b, s, l).
        isi_ms: the design grid [ms], shape (t,).
        fine: whether it is so fine that the peak lies on it.
    """
    people, size = particles.shape[:2]
    found, room = np.empty((people, size), dtype=np.float32), np.empty((2, max(3, len(isi_ms))), dtype=np.float32)
    for person in range(people):
        for i in range(size):
            highest = _highest(particles[person, i], isi_ms, fine, room)
            found[person, i] = _edge_level(particles[person, i], evoked[person, i], highest)
    return found


@loop
def _before(isi_ms: Any, edge_ms: Any) -> int:
    """How many of some ascending ISIs are below an edge."""
    low, high = 0, len(isi_ms)
    while low < high:
        middle = (low + high) // 2
        if isi_ms[middle] < edge_ms:
            low = middle + 1
        else:
            high = middle
    return low


@loop
def _runs(particle: Any, level: Any, isi_ms: Any, room: Any, runs: Any) -> None:
    """Write the two runs of a window, each its first index and the one behind its last; both 0 where there is none."""
    runs[0] = runs[1] = runs[2] = runs[3] = 0
    if level > _ONE and particle[SHAPE] != _TWO_PEAK:
        return
    if particle[SHAPE] == _TWO_PEAK:
        if level == _NOWHERE:
            return
        facilitations(particle, isi_ms, room, len(isi_ms))
        place, inside = 0, False
        for t in range(len(isi_ms)):
            if (room[t] >= level) != inside:
                inside = not inside
                runs[min(place, 3)] = t
                place += 1
        if inside:
            runs[min(place, 3)] = len(isi_ms)
        return
    away = math.sqrt(-_HALF * log(level))
    if particle[SHAPE] == _PLATEAU:
        away = exp(log(max(away, _LEAST_REACH)) * exp(_f(-0.75) * (particle[FORM] + _ONE)))
    peak_at, away_ms = _peak_at(particle), away * particle[WIDTH]
    peak_ms = particle[START] + peak_at * particle[WIDTH]
    first = _before(isi_ms, peak_ms - peak_at * away_ms)
    last_ms = peak_ms + (_ONE - peak_at) * away_ms
    behind = _before(isi_ms, last_ms)
    while behind < len(isi_ms) and isi_ms[behind] == last_ms:
        behind += 1
    if behind > first:
        runs[0], runs[1] = first, behind


@kernel
def window_runs(particles: Any, levels: Any, isi_ms: Any) -> Any:
    """Which ISIs are in each particle's window, as two runs of indices (first, behind the last), shape (b, s, 4).

    Args:
        particles: records, shape (b, s, PARTICLE).
        levels: facilitation at the edge, shape (b, s).
        isi_ms: ascending ISIs [ms], shape (t,).
    """
    people, size = levels.shape
    runs, room = np.empty((people, size, 4), dtype=np.int32), np.empty(len(isi_ms), dtype=np.float32)
    for person in range(people):
        for i in range(size):
            _runs(particles[person, i], levels[person, i], isi_ms, room, runs[person, i])
    return runs


@kernel
def masks_of(runs: Any, points: int) -> Any:
    """Windows as 0 or 1 (b, s, t) from their runs (b, s, 4) on so many ISIs."""
    people, size = runs.shape[:2]
    masks = np.zeros((people, size, points), dtype=np.float32)
    for person in range(people):
        for i in range(size):
            for side in (0, 2):
                for t in range(runs[person, i, side], runs[person, i, side + 1]):
                    masks[person, i, t] = _ONE
    return masks
