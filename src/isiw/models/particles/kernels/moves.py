"""Markov chain moves of particles in loops: proposal, prior of the blocks that change, likelihood, acceptance.

They are those of `isiw.models.particles.moves`; the draws come from outside.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from isiw.compiled import inlined, kernel, loop
from isiw.models.particles.kernels.likelihood import ROOM, history_likelihood
from isiw.models.particles.kernels.records import PARTICLE, PIECE, settle, trial_records
from isiw.models.particles.kernels.target import KINDS, fresh_values, log_block, meant
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

OWN_DRAWS: Final = 7 + KINDS + 7
"""Uniform draws of a move besides those that fresh latents take: acceptance, jump or not, which, and so on."""

_f = np.float32
_BLUR, _LEAST = _f(BLUR), _f(1e-30)
_ROOT_TURN = math.sqrt(2.0 * math.pi)


@inlined
def _which(quantile: Any, edges: Any) -> int:
    """Which of some alternatives is drawn, by the sums of the probabilities of earlier ones."""
    drawn = 0
    for number in range(len(edges)):
        drawn += quantile > edges[number]
    return drawn


@inlined
def _step_at(after: float, steps: Any) -> float:
    """The step of the amplitudes at the trial before which a change comes."""
    return float(steps[int(min(math.ceil(after), len(steps) - 1.0))])


@loop
def _favour(tables: Any, z: Any, kind: int, steps: Any, parts: Any) -> float:
    """Log of the prior of a change, or of none, by how `_change` proposes it."""
    none, span = float(tables.kinds[4, 0]), max(1.0, len(steps) - 1.0)
    if kind == 0:
        return math.log(2.0 * none)
    after, size, recent = math.exp(z[tables.at[27]]), float(z[tables.at[28]]), 0.0
    if after < span:
        apart = (size - _step_at(after, steps)) / STEP_SD
        of_size = log_block(z, tables.changed + 1, tables, parts)
        near = math.exp(-0.5 * apart * apart - math.log(STEP_SD) - of_size)
        recent = math.exp(z[tables.at[27]] - math.log(span) - log_block(z, tables.changed, tables, parts))
        recent *= _ROOT_TURN * (1.0 - OF_STEPS + OF_STEPS * near)
    return math.log((1.0 - none) / (RECENT * recent + 1.0 - RECENT))


@loop
def _change(tables: Any, steps: Any, draws: Any, normal: Any, z: Any, kinds: Any, fresh: Any, parts: Any) -> float:
    """Let a particle have another change, or none; the log ratio of prior to proposal. See `WindowTarget`."""
    when, size, changed = tables.at[27], tables.at[28], tables.changed
    uniform, none, span = draws[7 + KINDS : OWN_DRAWS], tables.kinds[4, 0], max(1.0, len(steps) - 1.0)
    if kinds[4] and uniform[0] < 0.5:
        before = log_block(z, changed, tables, parts) + log_block(z, changed + 1, tables, parts) - z[when]
        after, anywhere = math.exp(z[when]), uniform[1] < 0.5
        if anywhere and after < span:
            after = span * uniform[4]
        elif not anywhere:
            after += NEARLY * normal[when]
        if after <= 0.0:
            return -math.inf
        z[when] = _f(math.log(after))
        z[size] += _f(A_LITTLE) * uniform[5] * uniform[5] * normal[size]
        if uniform[3] < ANOTHER_KIND:
            kinds[4] = _which(none + (_f(1.0) - none) * uniform[2], tables.kinds[4])
        now = log_block(z, changed, tables, parts) + log_block(z, changed + 1, tables, parts) - z[when]
        return float(now - before)
    before = _favour(tables, z, kinds[4], steps, parts)
    fresh_values(changed, tables, draws[OWN_DRAWS:], normal, fresh)
    fresh_values(changed + 1, tables, draws[OWN_DRAWS:], normal, fresh)
    kinds[4] = 0 if uniform[1] < 0.5 else _which(none + (_f(1.0) - none) * uniform[2], tables.kinds[4])
    z[when], z[size] = fresh[when], fresh[size]
    if kinds[4] and uniform[3] < RECENT:
        after = max(span * uniform[4], 1e-3)
        z[when] = _f(math.log(after))
        if uniform[6] < OF_STEPS:
            z[size] = _f(_step_at(after, steps)) + _f(STEP_SD) * normal[size]
    return _favour(tables, z, kinds[4], steps, parts) - before


@inlined
def _jump(tables: Any, steps: Any, uniform: Any, normal: Any, z: Any, kinds: Any, fresh: Any, parts: Any) -> Any:
    """Draw some latents and kinds of a particle again; which jump it is, and the log ratio of prior to proposal."""
    jump, ratio = _which(uniform[2], tables.jumps), 0.0
    redrawn = tables.redrawn[jump]
    for block in range(len(tables.first)):
        first = tables.first[block]
        wanted = False
        for latent in range(first, first + tables.size[block]):
            wanted |= redrawn[latent]
        if wanted:
            fresh_values(block, tables, uniform[OWN_DRAWS:], normal, fresh)
            for latent in range(first, first + tables.size[block]):
                z[latent] = fresh[latent] if redrawn[latent] else z[latent]
    for kind in range(KINDS - 1):
        if tables.renewed[jump, kind]:
            kinds[kind] = _which(uniform[7 + kind], tables.kinds[kind])
    if tables.renewed[jump, KINDS - 1]:
        ratio = _change(tables, steps, uniform, normal, z, kinds, fresh, parts)
    return jump, ratio


@inlined
def _shift(tables: Any, theirs: Any, uniform: Any, normal: Any, moves: Any, z: Any) -> None:
    """Add a scaled difference of two of the others to the latents that move."""
    others = theirs.shape[0]
    one = theirs[min(int(uniform[5] * _f(others)), others - 1)]
    other = theirs[min(int(uniform[6] * _f(others)), others - 1)]
    scale = _f(1.0) if uniform[3] < _f(0.1) else _f(0.15) + _f(0.7) * uniform[4]
    for latent in range(len(moves)):
        if moves[latent]:
            z[latent] += scale * (one[latent] - other[latent]) + _BLUR * tables.spreads[latent] * normal[latent]


@inlined
def _log_ratio(tables: Any, moves: Any, old: Any, new: Any, parts: Any) -> float:
    """Log of the ratio of the prior densities, of the blocks that have moved alone."""
    ratio = 0.0
    for block in range(len(tables.first)):
        first = tables.first[block]
        moved = False
        for latent in range(first, first + tables.size[block]):
            moved |= moves[latent]
        if moved:
            ratio += log_block(new, block, tables, parts) - log_block(old, block, tables, parts)
    return ratio


@loop
def _log_place(tables: Any, z: Any, parts: Any) -> float:
    """Log density of the blocks that hold start and width."""
    summed, block = 0.0, 0
    while tables.first[block] < 2 and block < len(tables.first):
        summed += log_block(z, block, tables, parts)
        block += 1
    return summed


@inlined
def _overlap(tables: Any, z: Any) -> bool:
    """Whether enhancement and depression overlap where they may not."""
    if not tables.apart:
        return False
    at = tables.at
    start, end = z[at[0]], z[at[0]] + math.exp(z[at[1]])
    low_start, low_end = z[at[29]], z[at[29]] + math.exp(z[at[30]])
    return not (end <= low_start or low_end <= start)


@inlined
def _proposed(tables: Any, steps: Any, theirs: Any, kinds: Any, u: Any, n: Any, chosen: Any, scratch: Any) -> Any:
    """Write what a particle may move to, and return the log ratio of prior densities and whether it stays as it is."""
    old, new, fresh, parts = scratch[0], scratch[1], scratch[2], scratch[4]
    state = 0
    for kind in range(KINDS):
        chosen[kind] = kinds[kind]
        state += tables.states[kind] * kinds[kind]
    if u[1] < JUMP_PROBABILITY:
        jump, ratio = _jump(tables, steps, u, n, new, chosen, fresh, parts)
        same = tables.of_profile[jump] and not (kinds[2] or chosen[2])
    else:
        moves = tables.shifted[state, _which(u[2], tables.parts)]
        ratio, same = 0.0, True
        for latent in range(len(moves)):
            same &= not moves[latent]
        if not same:
            _shift(tables, theirs, u, n, moves, new)
            ratio = _log_ratio(tables, moves, old, new, parts)
    return -math.inf if _overlap(tables, new) else ratio, same


@loop
def _move_half(
    tables: Any, state: Any, mine: Any, theirs: Any, draws: Any, trials: Any, rooms: Any, counts: Any
) -> None:
    """Move half of the particles of one person once, in place."""
    values, kinds, log_likelihood, chosen = state
    (uniform, normal), (room, scratch) = draws, rooms
    known, sizes, censored, more_sizes, steps = trials
    old, new, particle = scratch[0], scratch[1], scratch[3]
    for i in range(mine[0], mine[1]):
        for latent in range(values.shape[1]):
            old[latent] = new[latent] = values[i, latent]
        ratio, same = _proposed(tables, steps, theirs, kinds[i], uniform[i], normal[i], chosen, scratch)
        before = log_likelihood[i]
        after = before
        if ratio > -math.inf and not same:
            meant(new, chosen, tables.at, particle)
            after = np.float32(history_likelihood(particle, known, sizes, censored, more_sizes, room))
        sort = 2 if uniform[i, 1] < JUMP_PROBABILITY else 0
        counts[sort] += 1
        if math.log(max(uniform[i, 0], _LEAST)) < after - before + ratio:
            counts[sort + 1] += 1
            log_likelihood[i] = after
            for latent in range(values.shape[1]):
                values[i, latent] = new[latent]
            for kind in range(KINDS):
                kinds[i, kind] = chosen[kind]


@kernel
def sweep(tables: Any, history: Any, steps: Any, state: Any, uniform: Any, normal: Any) -> Any:
    """Move every particle once, in place, one half by differences within the other."""
    values, kinds, log_likelihood = state
    people, size = values.shape[:2]
    counts, chosen = np.zeros((people, 4), dtype=np.float32), np.zeros(KINDS, dtype=np.int64)
    room, scratch = np.empty((ROOM, PIECE), dtype=np.float32), np.zeros((5, 64), dtype=np.float32)
    half = size // 2
    for person in range(people):
        told = history[person]
        trials = (*trial_records(told, False), *trial_records(told, True), steps[person])  # noqa: FBT003
        own = values[person], kinds[person], log_likelihood[person], chosen
        draws = uniform[person], normal[person]
        for first, behind in ((0, half), (half, size)):
            theirs = values[person, half:] if first == 0 else values[person, :half]
            mine = first, behind
            _move_half(tables, own, mine, theirs, draws, trials, (room, scratch), counts[person])
    return counts


@kernel
def records(tables: Any, values: Any, kinds: Any, trials: int) -> Any:
    """Records of particles after so many trials, or with their changes if it is negative, shape (b, p, PARTICLE)."""
    people, size, latents = values.shape
    found, z = np.empty((people, size, PARTICLE), dtype=np.float32), np.zeros(latents + 1, dtype=np.float32)
    for person in range(people):
        for i in range(size):
            z[:latents] = values[person, i]
            meant(z, kinds[person, i], tables.at, found[person, i])
            if trials >= 0:
                settle(found[person, i], _f(trials))
    return found


@kernel
def log_places(tables: Any, values: Any) -> Any:
    """Log prior density of start and width but for a constant, shape (b, p)."""
    people, size = values.shape[:2]
    found, parts = np.empty((people, size), dtype=np.float32), np.empty(64, dtype=np.float32)
    for person in range(people):
        for i in range(size):
            found[person, i] = _log_place(tables, values[person, i], parts)
    return found
