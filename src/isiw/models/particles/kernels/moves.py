"""Markov chain moves of particles in loops: proposal, prior of the blocks that change, likelihood, acceptance.

They are those of `isiw.models.particles.moves`; only the blur of a shift is not quite normal.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from isiw.compiled import kernel, loop, part
from isiw.models.particles.changes import ChangeKind
from isiw.models.particles.kernels.draws import blur, normal, uniform
from isiw.models.particles.kernels.likelihood import history_likelihood
from isiw.models.particles.kernels.records import PARTICLE, settle
from isiw.models.particles.kernels.target import KINDS, Tables, fresh_values, log_block, log_line, meant, which
from isiw.models.particles.moves import (
    A_LITTLE,
    ANOTHER_KIND,
    BLUR,
    JUMP_PROBABILITY,
    NEARLY,
    OF_STEPS,
    RECENT,
    STEP_SD,
)
from isiw.models.particles.noise import NoiseKind
from isiw.types import FloatArray

_ROWS: Final = 6
"""Rows of numbers that moves need in between: old and new latents, fresh ones, what they mean, the parts of a density,
and densities of blocks."""

_f = np.float32
_BLUR, _LEAST, _NIL, _ONE = _f(BLUR), _f(1e-30), _f(0.0), _f(1.0)
_ROOT_TURN = math.sqrt(2.0 * math.pi)
_RECRUITMENT, _RECTIFIED = NoiseKind.RECRUITMENT, NoiseKind.RECTIFIED
_UNCHANGED, _ENHANCEMENT = ChangeKind.NONE, ChangeKind.ENHANCEMENT
UNKNOWN: Final = _f(1e30)
"""In place of the log density of a block that was not worked out yet."""


def scratch_for(tables: Tables) -> FloatArray:
    """Room for what moves need in between: each row holds all latents, blocks, or parts of a density of a prior."""
    parts = int(np.abs(tables.components).max()) + len(tables.places)
    return np.zeros((_ROWS, max(len(tables.spreads) + 1, len(tables.first), parts, PARTICLE)), dtype=np.float32)


@loop
def _step_at(after: float, steps: Any) -> float:
    """The step of the amplitudes at the trial before which a change comes."""
    return float(steps[int(min(math.ceil(after), len(steps) - 1.0))])


@loop
def _log_change(law: Any, of: Any, z: Any) -> Any:
    """Log density of when a change comes, and of its size."""
    log_shares, means, sds = law
    when, size, changed = of
    of_when = log_line(z[when], log_shares[changed], means[:, when], sds[:, when])
    return of_when, log_line(z[size], log_shares[changed + 1], means[:, size], sds[:, size])


@loop
def _favour(law: Any, of: Any, none: float, z: Any, kind: int, steps: Any) -> float:
    """Log of the prior of a change, or of none, by how `_other_change` proposes it."""
    span = max(1.0, len(steps) - 1.0)
    if kind == 0:
        return math.log(2.0 * none)
    after, recent = math.exp(z[of[0]]), 0.0
    if after < span:
        of_when, of_size = _log_change(law, of, z)
        apart = (z[of[1]] - _step_at(after, steps)) / STEP_SD
        near = math.exp(-0.5 * apart * apart - math.log(STEP_SD) - of_size)
        recent = math.exp(z[of[0]] - math.log(span) - of_when)
        recent *= _ROOT_TURN * (1.0 - OF_STEPS + OF_STEPS * near)
    return math.log((1.0 - none) / (RECENT * recent + 1.0 - RECENT))


@loop
def _moved_change(law: Any, of: Any, edges: Any, steps: Any, dice: Any, z: Any, kinds: Any) -> float:
    """Move a change a little, or to another trial; the log ratio of prior to proposal. See `WindowTarget`."""
    (when, size, _), span, none = of, max(1.0, len(steps) - 1.0), edges[0]
    of_when, of_size = _log_change(law, of, z)
    before, after = of_when + of_size - z[when], math.exp(z[when])
    if uniform(dice) < 0.5:
        after = span * uniform(dice) if after < span else after
    else:
        after += NEARLY * normal(dice)
    if after <= 0.0:
        return -math.inf
    share = uniform(dice)
    z[when], z[size] = _f(math.log(after)), z[size] + _f(A_LITTLE) * share * share * normal(dice)
    if uniform(dice) < ANOTHER_KIND:
        kinds[4] = which(none + (_ONE - none) * uniform(dice), edges)
    of_when, of_size = _log_change(law, of, z)
    return float(of_when + of_size - z[when] - before)


@loop
def _other_change(law: Any, of: Any, below: Any, edges: Any, steps: Any, dice: Any, z: Any, kinds: Any) -> float:
    """Let a particle have another change, or none; the log ratio of prior to proposal. See `WindowTarget`."""
    (when, size, changed), (_, means, sds), span, none = of, law, max(1.0, len(steps) - 1.0), edges[0]
    before = _favour(law, of, none, z, kinds[4], steps)
    for number in range(2):
        latent, component = of[number], which(uniform(dice), below[changed + number])
        z[latent] = means[component, latent] + sds[component, latent] * normal(dice)
    kinds[4] = 0 if uniform(dice) < 0.5 else which(none + (_ONE - none) * uniform(dice), edges)
    if kinds[4] and uniform(dice) < RECENT:
        after = max(span * uniform(dice), 1e-3)
        z[when] = _f(math.log(after))
        if uniform(dice) < OF_STEPS:
            z[size] = _f(_step_at(after, steps)) + _f(STEP_SD) * normal(dice)
    return _favour(law, of, none, z, kinds[4], steps) - before


@loop
def _jump(tables: Any, steps: Any, dice: Any, z: Any, kinds: Any, scratch: Any) -> Any:
    """Draw some latents and kinds of a particle again; which jump it is, and the log ratio of prior to proposal."""
    jump, ratio, fresh = which(uniform(dice), tables.jumps), 0.0, scratch[2]
    redrawn = tables.redrawn[jump]
    for block in range(len(tables.first)):
        first = tables.first[block]
        wanted = False
        for latent in range(first, first + tables.size[block]):
            wanted |= redrawn[latent]
        if wanted:
            fresh_values(block, tables, dice, fresh)
            for latent in range(first, first + tables.size[block]):
                z[latent] = fresh[latent] if redrawn[latent] else z[latent]
    for kind in range(KINDS - 1):
        if tables.renewed[jump, kind]:
            kinds[kind] = which(uniform(dice), tables.kinds[kind])
    if tables.renewed[jump, KINDS - 1]:
        law, of = (tables.log_shares, tables.means, tables.sds), (tables.at[27], tables.at[28], tables.changed)
        if kinds[KINDS - 1] and uniform(dice) < 0.5:
            ratio = _moved_change(law, of, tables.kinds[4], steps, dice, z, kinds)
        else:
            ratio = _other_change(law, of, tables.below, tables.kinds[4], steps, dice, z, kinds)
    return jump, ratio


@part
def _shift(tables: Any, theirs: Any, dice: Any, moving: Any, densities: Any, scratch: Any) -> float:
    """Add a scaled difference of two of the others to the latents that move; log of the ratio of prior densities."""
    moves, touched = moving
    others, z, found, ratio = theirs.shape[0], scratch[1], scratch[5], 0.0
    one = theirs[min(int(uniform(dice) * _f(others)), others - 1)]
    other = theirs[min(int(uniform(dice) * _f(others)), others - 1)]
    scale = _ONE if uniform(dice) < _f(0.1) else _f(0.15) + _f(0.7) * uniform(dice)
    for latent in range(len(moves)):
        if moves[latent]:
            z[latent] += scale * (one[latent] - other[latent]) + _BLUR * tables.spreads[latent] * blur(dice)
    for block in range(len(tables.first)):
        found[block] = UNKNOWN
        if touched[block]:
            for side in range(0 if densities[block] == UNKNOWN else 1, 2):
                found[block] = log_block(scratch[side], block, tables, scratch[4])
                if side == 0:
                    densities[block] = found[block]
            ratio += found[block] - densities[block]
    return ratio


@loop
def _overlap(at: Any, z: Any) -> bool:
    """Whether enhancement and depression overlap."""
    start, end = z[at[0]], z[at[0]] + math.exp(z[at[1]])
    low_start, low_end = z[at[29]], z[at[29]] + math.exp(z[at[30]])
    return not (end <= low_start or low_end <= start)


@part
def _proposed(tables: Any, steps: Any, theirs: Any, own: Any, jumps: Any, dice: Any, scratch: Any) -> Any:
    """Write what a particle may move to, and return the log ratio of prior densities and whether it stays as it is."""
    (kinds, densities, chosen), state, ratio, same, new = own, 0, 0.0, True, scratch[1]
    for kind in range(KINDS):
        chosen[kind] = kinds[kind]
        state += tables.states[kind] * kinds[kind]
    if jumps:
        jump, ratio = _jump(tables, steps, dice, new, chosen, scratch)
        same = tables.of_profile[jump] and not (kinds[2] or chosen[2])
    else:
        of = which(uniform(dice), tables.parts)
        touched = tables.touched[state, of]
        for block in range(len(touched)):
            same &= not touched[block]
        if not same:
            ratio = _shift(tables, theirs, dice, (tables.shifted[state, of], touched), densities, scratch)
    if tables.apart and _overlap(tables.at, new):
        ratio = -math.inf
    return ratio, same


@part
def _move(tables: Any, state: Any, i: int, theirs: Any, trials: Any, dice: Any, rooms: Any, counts: Any) -> None:
    """Move a particle once, in place."""
    values, kinds, log_likelihood, densities, chosen = state
    records, sizes, steps = trials
    room, scratch = rooms
    old, new, particle = scratch[0], scratch[1], scratch[3]
    for latent in range(values.shape[1]):
        old[latent] = new[latent] = values[i, latent]
    jumps = uniform(dice) < JUMP_PROBABILITY
    own = kinds[i], densities[i], chosen
    ratio, same = _proposed(tables, steps, theirs, own, jumps, dice, scratch)
    before = log_likelihood[i]
    after = before
    if ratio > -math.inf and not same:
        meant(new, chosen, tables.at, particle)
        after = _f(history_likelihood(particle, records, sizes, room))
    sort = 2 if jumps else 0
    counts[sort] += 1
    if math.log(max(uniform(dice), _LEAST)) < after - before + ratio:
        counts[sort + 1] += 1
        log_likelihood[i] = after
        for latent in range(values.shape[1]):
            values[i, latent] = new[latent]
        for kind in range(KINDS):
            kinds[i, kind] = chosen[kind]
        for block in range(len(tables.first)):
            if jumps:
                densities[i, block] = UNKNOWN
            elif not same and scratch[5, block] != UNKNOWN:
                densities[i, block] = scratch[5, block]


@kernel
def sweeps(numbers: Any, tables: Any, history: Any, steps: Any, state: Any, dice: Any, rooms: Any, counts: Any) -> None:
    """Move every particle of each person some times, in place, one half by differences within the other."""
    values, kinds, log_likelihood, densities, chosen = state  # densities of the blocks, and room for one's kinds
    records, sizes = history
    half = values.shape[1] // 2
    for person in range(values.shape[0]):
        own = values[person], kinds[person], log_likelihood[person], densities[person], chosen
        trials = records[person], sizes[person], steps[person]
        for _ in range(numbers[person]):
            for i in range(values.shape[1]):
                theirs = values[person, half:] if i < half else values[person, :half]
                _move(tables, own, i, theirs, trials, dice[person], rooms, counts[person])


def records(tables: Any, values: Any, kinds: Any, trials: int) -> Any:
    """Records of particles after so many trials, or with their changes if it is negative, shape (b, p, PARTICLE)."""
    found, z = np.empty((*kinds.shape[:2], PARTICLE), np.float32), np.zeros(values.shape[2] + 1, np.float32)
    _records(tables, values, kinds, trials, z, found)
    return found


@kernel
def _records(tables: Any, values: Any, kinds: Any, trials: int, z: Any, found: Any) -> None:
    latents = values.shape[2]
    for person in range(values.shape[0]):
        for i in range(values.shape[1]):
            for latent in range(latents):
                z[latent] = values[person, i, latent]
            meant(z, kinds[person, i], tables.at, found[person, i])
            if trials >= 0:
                settle(found[person, i], _f(trials))


@loop
def _weighed(tables: Any, block: int, kinds: Any) -> Any:
    """Whether a block is one that ISIs are chosen with another law of, and means anything to a particle."""
    first, noise, change = tables.first[block], kinds[1], kinds[4]
    stepped = change != _UNCHANGED and change != _ENHANCEMENT  # noqa: PLR1714 - kernels know no enumerations in tuples
    curve = (noise == _RECRUITMENT and first == tables.at[14]) or (noise == _RECTIFIED and first == tables.at[20])
    place, change_comes = first < 2 and kinds[2] != 0, stepped and block == tables.changed
    return place or curve or first == tables.at[5] or change_comes


@kernel
def log_usual(tables: Any, values: Any, kinds: Any, densities: Any, parts: Any, found: Any) -> None:
    """Write the log prior density of what ISIs are chosen with another law of, but for a constant, shape (b, p)."""
    edges = tables.kinds[4]
    for person in range(values.shape[0]):
        for i in range(values.shape[1]):
            change = kinds[person, i, 4]
            share = (edges[change] if change < len(edges) else _ONE) - (edges[change - 1] if change else _NIL)
            found[person, i] = math.log(max(share, _LEAST))
            for block in range(len(tables.first)):
                if _weighed(tables, block, kinds[person, i]):
                    density = densities[person, i, block]
                    if density == UNKNOWN:
                        density = log_block(values[person, i], block, tables, parts)
                    found[person, i] += density
