"""Acquisition functions based on information: what the next MEP is expected to tell.

About all unknowns of the model (BALD [Houlsby2011]), or about the window alone: its place, or each ISI's membership in
it (stepwise uncertainty reduction for excursion sets [Bect2012; Chevalier2014]).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, ClassVar, Protocol

import numpy as np

from isiw.acquisition.protocol import ForeseesWindows
from isiw.checks import Checked, can, whole
from isiw.models.protocol import (
    CountsPairs,
    ForeseesReductions,
    Posterior,
    PredictsOutcomes,
    SamplesDepression,
    SamplesWindows,
)
from isiw.native import engine
from isiw.types import Array, BoolArray, IntArray, Singles


class _CountedWindows(Posterior, ForeseesWindows, Protocol):
    """A posterior of windows that predicts the next MEP, and knows how many trials there were."""


def _entropy(mass: Array) -> Array:
    # Probabilities that are practically 0 add practically nothing.
    entropy: Array = -(np.log(np.maximum(mass, 1e-30)) * mass).sum(-1)
    return entropy


def _for_the_engine(values: Array) -> Singles:
    """The same in single precision, side by side."""
    return np.ascontiguousarray(values, dtype=np.float32)


def _cells(masks: Array, cells: int) -> IntArray:
    """Which cell of starts and ends each sampled window falls into, shape (b, s); 0 is no window."""
    first, last = masks.argmax(-1), masks.shape[-1] - 1 - masks[..., ::-1].argmax(-1)
    found: BoolArray = masks.max(-1) > 0
    start, end = (_quantile_cell(edge, found, cells) for edge in (first, last))
    return np.where(found, 1 + start * cells + end, 0)


def _quantile_cell(edge: IntArray, found: BoolArray, cells: int) -> IntArray:
    """Rank of each edge among those of the same person, in equal cells; equal edges share one, shape (b, s)."""
    below = (edge[..., None] > edge[..., None, :]) & found[..., None, :]
    rank: IntArray = below.sum(-1) * cells // np.maximum(found.sum(-1, keepdims=True), 1)
    return np.minimum(rank, cells - 1)


@dataclass(frozen=True)
class MutualInformation:
    """Mutual information of the next MEP and all unknowns."""

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes,)

    def __call__(self, posterior: PredictsOutcomes, isi_ms: Array) -> Array:
        """The information [nat], shape (b, t)."""
        if can(posterior, ForeseesReductions):
            return posterior.reductions(isi_ms, of_window=False)
        mass = _for_the_engine(posterior.outcome_mass(isi_ms))
        return np.stack([engine.reductions(each, each[:, 0, :0]) for each in mass])


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

    def __call__(self, posterior: ForeseesWindows, isi_ms: Array) -> Array:
        """The information [nat], shape (b, t)."""
        mass, cell = posterior.outcome_mass(isi_ms), _cells(posterior.window_masks(isi_ms), self.cells)
        people, samples, candidates, outcomes = mass.shape
        members = np.eye(self.cells * self.cells + 1, dtype=mass.dtype)[cell]
        summed = members.swapaxes(1, 2) @ mass.reshape(people, samples, -1)
        within = summed / np.maximum(members.sum(axis=1), 1.0)[..., None]
        left = _entropy(within.reshape(people, -1, candidates, outcomes))
        expected: Array = (members.mean(axis=1)[:, None] @ left)[:, 0]
        return _entropy(mass.mean(axis=1)) - expected


@dataclass(frozen=True)
class WindowGain:
    """Expected reduction of the uncertainty about which ISIs are in the window, or are depressed."""

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesWindows)

    def __call__(self, posterior: ForeseesWindows, isi_ms: Array) -> Array:
        """Expected reduction of the summed variance of membership, shape (b, t)."""
        if can(posterior, ForeseesReductions):
            return posterior.reductions(isi_ms, of_window=True)
        masks = posterior.window_masks(isi_ms)
        if can(posterior, SamplesDepression):
            masks = np.concatenate((masks, posterior.depressed_masks(isi_ms)), axis=-1)
        people = zip(*map(_for_the_engine, (posterior.outcome_mass(isi_ms), masks)), strict=True)
        return np.stack([engine.reductions(mass, inside) for mass, inside in people])


@dataclass(frozen=True)
class Alternating:
    """The window on one pair of stimuli, all unknowns on the next.

    What is unknown about a person's responses costs certainty about the window later, but on no single trial enough for
    `WindowGain` to ask for it; `MutualInformation` asks for little else.
    """

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesWindows)

    def __call__(self, posterior: _CountedWindows, isi_ms: Array) -> Array:
        """Score the candidate ISIs."""
        pairs = posterior.pairs if can(posterior, CountsPairs) else posterior.trials
        return MutualInformation()(posterior, isi_ms) if pairs % 2 else WindowGain()(posterior, isi_ms)
