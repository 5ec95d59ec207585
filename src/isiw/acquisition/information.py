"""Acquisition functions based on information: what the next MEP is expected to tell.

About all unknowns of the model (BALD [Houlsby2011]), or about the window alone: its place, or each ISI's membership in
it (stepwise uncertainty reduction for excursion sets [Bect2012; Chevalier2014]).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, ClassVar, Protocol

import numpy as np

from isiw.acquisition.protocol import ForeseesWindows
from isiw.acquisition.twostep import expected_variance_reduction
from isiw.checks import Checked, can, whole
from isiw.compiled import AVAILABLE, first_of, kernel, log, loop, total
from isiw.lazy import torch
from isiw.models.protocol import (
    CountsPairs,
    Posterior,
    PredictsOutcomes,
    SamplesDepression,
    SamplesWindows,
    Tensor,
)

_f = np.float32
_NIL, _LEAST, _TINY = _f(0.0), _f(1e-12), _f(1e-30)


def entropy_reductions(mass: Any) -> Any:
    """Entropy of the mean distribution less the mean entropy [nat], shape (b, t)."""
    people, _, candidates, outcomes = mass.shape
    found, mean = np.empty((people, candidates), np.float32), np.empty((candidates, outcomes), np.float32)
    for person in range(people):
        _entropies(mass[person], mean, np.empty(outcomes, np.float32), found[person])
    return found


@kernel
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


def variance_reductions(mass: Any, masks: Any) -> Any:
    """Variance of each ISI's probability of membership after the next outcome, summed, shape (b, t).

    Sampled windows are runs of ISIs, so that what changes from one ISI to the next is summed instead of all of them.
    """
    people, samples, candidates, outcomes = mass.shape
    points = masks.shape[2]
    found, mean = np.empty((people, candidates), np.float32), np.empty(points, np.float32)
    steps, inside = np.empty((points, outcomes), np.float32), np.empty((3, outcomes), np.float32)
    at, rises = np.empty((samples, points), np.int64), np.empty((samples, points), np.float32)
    counts = np.empty(samples, np.int64)
    for person in range(people):
        _reductions(mass[person], masks[person], (at, rises, counts, mean), steps, inside, found[person])
    return found


@kernel
def _reductions(mass: Any, masks: Any, changes: Any, steps: Any, inside: Any, found: Any) -> None:
    at, rises, counts, mean = changes
    _changes(masks, at, rises, counts, mean)
    for t in range(len(found)):
        found[t] = _reduction(mass, t, at, rises, counts, mean, steps, inside)


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


class _CountedWindows(Posterior, ForeseesWindows, Protocol):
    """A posterior of windows that predicts the next MEP, and knows how many trials there were."""


def _entropy(mass: Tensor) -> Tensor:
    # `torch.special.entr`, several times as fast: probabilities that are practically 0 add practically nothing.
    entropy: Tensor = -mass.clamp_min(1e-30).log_().mul_(mass).sum(-1)
    return entropy


def _is_for_kernels(mass: Tensor) -> bool:
    """True if compiled loops are there for it: in single precision, on the CPU."""
    return AVAILABLE and mass.dtype == torch.float32 and mass.device.type == "cpu"


def _cells(masks: Tensor, cells: int) -> Tensor:
    """Which cell of starts and ends each sampled window falls into, shape (b, s); 0 is no window."""
    first, last = masks.argmax(-1), masks.shape[-1] - 1 - masks.flip(-1).argmax(-1)
    found = masks.any(-1)
    start, end = (_quantile_cell(edge, found, cells) for edge in (first, last))
    return torch.where(found, 1 + start * cells + end, 0)


def _quantile_cell(edge: Tensor, found: Tensor, cells: int) -> Tensor:
    """Rank of each edge among those of the same person, in equal cells; equal edges share one, shape (b, s)."""
    below = (edge.unsqueeze(-1) > edge.unsqueeze(-2)) & found.unsqueeze(-2)
    return (
        (below.sum(-1) * cells)
        .div(found.sum(-1, keepdim=True).clamp_min(1), rounding_mode="floor")
        .clamp_max(cells - 1)
    )


@dataclass(frozen=True)
class MutualInformation:
    """Mutual information of the next MEP and all unknowns."""

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes,)

    def __call__(self, posterior: PredictsOutcomes, isi_ms: Tensor) -> Tensor:
        """The information [nat], shape (b, t)."""
        mass = posterior.outcome_mass(isi_ms)
        if _is_for_kernels(mass):
            with first_of("scores"):
                return torch.from_numpy(entropy_reductions(mass.numpy()))
        return _entropy(mass.mean(dim=1)) - _entropy(mass).mean(dim=1)


@dataclass(frozen=True)
class WindowInformation(Checked):
    """Mutual information of the next MEP and the window alone.

    The window is described as precisely as the samples allow: the quantile cell of its start and of its end, or
    that there is none. Whatever else differs among the samples of a cell is averaged out, as far as a cell has
    many: with few samples the value is too high, by .01 to .04 nat with 192, and good for comparing ISIs only.

    Args:
        cells: into how many cells each edge falls.
    """

    cells: Annotated[int, partial(whole, least=2)] = 5
    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesWindows)

    def __call__(self, posterior: ForeseesWindows, isi_ms: Tensor) -> Tensor:
        """The information [nat], shape (b, t)."""
        mass, cell = posterior.outcome_mass(isi_ms), _cells(posterior.window_masks(isi_ms), self.cells)
        members = torch.nn.functional.one_hot(cell, self.cells * self.cells + 1).to(mass.dtype)
        share = members.mean(dim=1)
        within = torch.einsum("bsc,bsty->bcty", members, mass) / members.sum(dim=1).clamp_min(1.0)[..., None, None]
        return _entropy(mass.mean(dim=1)) - torch.einsum("bc,bct->bt", share, _entropy(within))


@dataclass(frozen=True)
class WindowGain:
    """Expected reduction of the uncertainty about which ISIs are in the window, or are depressed."""

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesWindows)

    def __call__(self, posterior: ForeseesWindows, isi_ms: Tensor) -> Tensor:
        """Expected reduction of the summed variance of membership, shape (b, t)."""
        masks = posterior.window_masks(isi_ms)
        if can(posterior, SamplesDepression):
            masks = torch.cat((masks, posterior.depressed_masks(isi_ms)), dim=-1)
        mass = posterior.outcome_mass(isi_ms)
        if _is_for_kernels(mass):
            with first_of("scores of windows"):
                return torch.from_numpy(variance_reductions(mass.numpy(), masks.to(torch.float32).numpy()))
        return expected_variance_reduction(mass, masks)


@dataclass(frozen=True)
class Alternating:
    """The window on one pair of stimuli, all unknowns on the next.

    What is unknown about a person's responses costs certainty about the window later, but on no single trial enough for
    `WindowGain` to ask for it; `MutualInformation` asks for little else.
    """

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesWindows)

    def __call__(self, posterior: _CountedWindows, isi_ms: Tensor) -> Tensor:
        """Score the candidate ISIs."""
        pairs = posterior.pairs if can(posterior, CountsPairs) else posterior.trials
        return MutualInformation()(posterior, isi_ms) if pairs % 2 else WindowGain()(posterior, isi_ms)
