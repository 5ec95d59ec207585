"""Scores in compiled loops: what `information` and `lookahead` say in torch, for one processor."""

from __future__ import annotations

from typing import Any

import numpy as np

from isiw.compiled import kernel, log, loop, total

_f = np.float32
_NIL, _LEAST, _TINY = _f(0.0), _f(1e-12), _f(1e-30)


@kernel
def entropy_reductions(mass: Any) -> Any:
    """Entropy of the mean distribution less the mean entropy [nat], shape (b, t)."""
    people, _, candidates, outcomes = mass.shape
    found = np.empty((people, candidates), dtype=np.float32)
    mean, room = np.empty((candidates, outcomes), dtype=np.float32), np.empty(outcomes, dtype=np.float32)
    for person in range(people):
        _entropies(mass[person], mean, room, found[person])
    return found


@loop
def _entropies(mass: Any, mean: Any, room: Any, found: Any) -> None:
    """Write the entropy of the mean distribution less the mean entropy of one person, shape (t,)."""
    samples, candidates, outcomes = mass.shape
    share = _f(1.0) / _f(samples)
    for t in range(candidates):
        found[t] = _NIL
        for y in range(outcomes):
            mean[t, y] = _NIL
    for s in range(samples):
        for t in range(candidates):
            given, of_all = mass[s, t], mean[t]
            for y in range(outcomes):
                room[y] = given[y] * log(max(given[y], _TINY))
            for y in range(outcomes):
                of_all[y] += share * given[y]
            found[t] += share * total(room, outcomes)
    for t in range(candidates):
        for y in range(outcomes):
            room[y] = mean[t, y] * log(max(mean[t, y], _TINY))
        found[t] -= total(room, outcomes)


@kernel
def variance_reductions(mass: Any, masks: Any) -> Any:
    """Variance of each ISI's probability of membership after the next outcome, summed, shape (b, t).

    Sampled windows are runs of ISIs, so that what changes from one ISI to the next is summed instead of all of them.
    """
    people, samples, candidates, outcomes = mass.shape
    points = masks.shape[2]
    found = np.empty((people, candidates), dtype=np.float32)
    steps, inside = np.empty((points, outcomes), dtype=np.float32), np.empty((3, outcomes), dtype=np.float32)
    mean = np.empty(points, dtype=np.float32)
    at, rises = np.empty((samples, points), dtype=np.int64), np.empty((samples, points), dtype=np.float32)
    counts = np.empty(samples, dtype=np.int64)
    for person in range(people):
        _changes(masks[person], at, rises, counts, mean)
        for t in range(candidates):
            found[person, t] = _reduction(mass[person], t, at, rises, counts, mean, steps, inside)
    return found


@loop
def _changes(masks: Any, at: Any, rises: Any, counts: Any, mean: Any) -> None:
    """Write where each sampled window begins and ends, how often, and the share of the windows at each ISI."""
    samples, points = masks.shape
    for g in range(points):
        mean[g] = _NIL
    for s in range(samples):
        count, before = 0, _NIL
        for g in range(points):
            mean[g] += masks[s, g]
            if masks[s, g] != before:
                at[s, count], rises[s, count] = g, masks[s, g] - before
                count, before = count + 1, masks[s, g]
        counts[s] = count
    for g in range(points):
        mean[g] /= _f(samples)


@loop
def _spread(mass: Any, t: int, at: Any, rises: Any, counts: Any, steps: Any, all_of: Any) -> None:
    """Write by how much each outcome's windows change from one ISI to the next, and its probability, up to samples."""
    samples, outcomes = mass.shape[0], mass.shape[2]
    for y in range(outcomes):
        all_of[y] = _NIL
        for g in range(steps.shape[0]):
            steps[g, y] = _NIL
    for s in range(samples):
        given = mass[s, t]
        for y in range(outcomes):
            all_of[y] += given[y]
        for change in range(counts[s]):
            step, rise = steps[at[s, change]], rises[s, change]
            for y in range(outcomes):
                step[y] += rise * given[y]


@loop
def _reduction(mass: Any, t: int, at: Any, rises: Any, counts: Any, mean: Any, steps: Any, inside: Any) -> Any:
    """Expected reduction of the summed variance by a trial at one candidate."""
    outcomes, all_of, summed, reduced = mass.shape[2], inside[0], inside[1], inside[2]
    _spread(mass, t, at, rises, counts, steps, all_of)
    for y in range(outcomes):
        summed[y] = reduced[y] = _NIL
    for g in range(steps.shape[0]):
        step, expected = steps[g], mean[g]
        for y in range(outcomes):
            summed[y] += step[y]
        for y in range(outcomes):
            apart = summed[y] - expected * all_of[y]
            reduced[y] += apart * apart
    for y in range(outcomes):
        reduced[y] /= max(all_of[y], _LEAST)
    return total(reduced, outcomes) / _f(mass.shape[0])
