"""Windows of particles in loops: where facilitation crosses the level of an edge, as runs of ISIs."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from isiw.compiled import exp, kernel, log, loop
from isiw.models.particles.kernels.predictions import position_of
from isiw.models.particles.kernels.profile import facilitations
from isiw.models.particles.kernels.records import FLOOR_SD, FORM, LOG_FLOOR, PRESENT, SHAPE, START, WIDTH
from isiw.models.particles.shapes import PEAKS_AT, ShapeKind
from isiw.window import EDGE_LEVEL, MIN_EXCESS_MV, MIN_EXCESS_OF_BASELINE

_f = np.float32
_NIL, _HALF, _ONE, _LEAST_REACH = _f(0.0), _f(0.5), _f(1.0), _f(1e-12)
_PLATEAU, _SKEWED, _TWO_PEAK = (_f(kind) for kind in (ShapeKind.PLATEAU, ShapeKind.SKEWED, ShapeKind.TWO_PEAK))
_EDGE, _ENOUGH_MV, _ENOUGH = _f(EDGE_LEVEL), _f(MIN_EXCESS_MV), _f(MIN_EXCESS_OF_BASELINE)
_FIRST_PEAK, _SECOND_PEAK = _f(PEAKS_AT[0]), _f(PEAKS_AT[1])
_NOWHERE: Final = _f(2.0)


@loop
def _peak_at(particle: Any) -> Any:
    """Where a profile of one peak has it, as a share of the span."""
    return _HALF + _f(0.33) * particle[FORM] if particle[SHAPE] == _SKEWED else _HALF


@loop
def _highest(particle: Any, isi_ms: Any, fine: Any, room: Any) -> Any:
    """Largest facilitation at some ISIs; where they are close to each other, in all of their range."""
    count = len(isi_ms)
    if fine:
        low, high, at = isi_ms[0], isi_ms[count - 1], room[1, :3]
        count = len(at)
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
    position = position_of(highest, _NIL, rows)
    row = max(min(int(position), rows - 2), 0)
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


def edge_levels(particles: Any, evoked: Any, isi_ms: Any, *, fine: bool) -> Any:
    """Facilitation at each window's edge, shape (b, s); 2 where there is no window."""
    found, room = np.empty(particles.shape[:2], np.float32), np.empty((2, max(3, len(isi_ms))), np.float32)
    _edge_levels(particles, evoked, isi_ms, fine, room, found)
    return found


@kernel
def _edge_levels(particles: Any, evoked: Any, isi_ms: Any, fine: Any, room: Any, found: Any) -> None:
    for person in range(particles.shape[0]):
        for i in range(particles.shape[1]):
            highest = _highest(particles[person, i], isi_ms, fine, room)
            found[person, i] = _edge_level(particles[person, i], evoked[person, i], highest)


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


def window_runs(particles: Any, levels: Any, isi_ms: Any) -> Any:
    """Which ISIs are in each particle's window, as two runs of indices (first, behind the last), shape (b, s, 4)."""
    runs, room = np.empty((*levels.shape, 4), np.int32), np.empty(len(isi_ms), np.float32)
    _window_runs(particles, levels, isi_ms, room, runs)
    return runs


@kernel
def _window_runs(particles: Any, levels: Any, isi_ms: Any, room: Any, runs: Any) -> None:
    for person in range(levels.shape[0]):
        for i in range(levels.shape[1]):
            _runs(particles[person, i], levels[person, i], isi_ms, room, runs[person, i])


def masks_of(runs: Any, points: int) -> Any:
    """Windows as 0 or 1 (b, s, t) from their runs (b, s, 4) on so many ISIs."""
    at, firsts, behinds = np.arange(points), runs[..., ::2, np.newaxis], runs[..., 1::2, np.newaxis]
    return ((firsts <= at) & (at < behinds)).any(-2).astype(np.float32)
