"""Designs that do not look at the responses, and those that leave the choice to the method itself."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from isiw.acquisition.protocol import golden_index
from isiw.checks import Checked, Count, Positive
from isiw.design import DesignSpace
from isiw.lazy import scipy
from isiw.models.protocol import Posterior, ProposesIsi
from isiw.types import Array, FloatArray, Singles


def _only(index: int, isi_ms: Array) -> Singles:
    scores = np.zeros((1, len(isi_ms)), dtype=np.float32)
    scores[0, index] = 1.0
    return scores


@dataclass(frozen=True)
class EvenSpacing:
    """Candidate ISIs that fill the range evenly: multiples of the golden ratio, modulo the range."""

    needs: ClassVar[tuple[type, ...]] = ()

    def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
        """Score the ISI whose turn it is 1 and all others 0, shape (1, t)."""
        return _only(golden_index(posterior.trials, len(isi_ms)), isi_ms)


@dataclass(frozen=True)
class RandomIsi:
    """Uniformly random ISIs among the candidates, which in a wide space are not all of its ISIs.

    Args:
        seed: seed of the order.
    """

    seed: int = 0
    needs: ClassVar[tuple[type, ...]] = ()

    def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
        """Score the ISI drawn for this trial 1 and all others 0, shape (1, t)."""
        rng = np.random.default_rng([self.seed, 1 + posterior.trials])  # [seed, 0] is the stream of seed
        return _only(int(rng.integers(len(isi_ms))), isi_ms)


@dataclass(frozen=True)
class SobolIsi:
    """Candidate ISIs from a scrambled Sobol sequence [Owen1998]: random, and yet evenly spread.

    Args:
        seed: seed of the scrambling.
    """

    seed: int = 0
    needs: ClassVar[tuple[type, ...]] = ()

    def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
        """Score the ISI whose turn it is 1 and all others 0, shape (1, t)."""
        share = float(
            scipy.stats.qmc.Sobol(1, seed=self.seed).random_base2(posterior.trials.bit_length())[posterior.trials, 0]
        )
        return _only(min(int(share * len(isi_ms)), len(isi_ms) - 1), isi_ms)


@dataclass(frozen=True)
class IncrementalSweep(Checked):
    """From the lowest ISI to the highest, some trials at each: the conventional search; then from the start again.

    A strategy follows it on the grid of its space, pair by pair (`FollowsPlan`).

    Args:
        step_ms: from one ISI to the next [ms]; where that is none of the space's, the next multiple of its step.
        trials_per_isi: pairs of stimuli at each.
    """

    step_ms: Positive = 5.0
    trials_per_isi: Count = 12
    needs: ClassVar[tuple[type, ...]] = ()

    def planned_isi_ms(self, space: DesignSpace, pairs: int) -> float:
        """The ISI [ms] of the pair of stimuli after so many pairs; see `FollowsPlan`."""
        isis_ms = stops_ms(space, self.step_ms)
        return space.snap(float(isis_ms[pairs // self.trials_per_isi % len(isis_ms)]))

    def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
        """Score the ISI nearest to the one whose turn it is after so many trials 1 and all others 0, shape (1, t)."""
        # Candidates are in single precision, in which a range may come out a little below a whole number of steps.
        stops = math.floor(float(isi_ms[-1] - isi_ms[0]) / self.step_ms + 1e-4) + 1
        turn = posterior.trials // self.trials_per_isi % stops
        return _only(int(np.abs(isi_ms - (isi_ms[0] + turn * self.step_ms)).argmin()), isi_ms)


@dataclass(frozen=True)
class OwnProposal:
    """The ISI that the method itself wants."""

    needs: ClassVar[tuple[type, ...]] = (ProposesIsi,)

    def __call__(self, posterior: ProposesIsi, isi_ms: Array) -> Array:
        """Score ISIs by their distance [ms] from the one it wants, negative, shape (b, t)."""
        return -np.abs(isi_ms - posterior.proposed_isis_ms()[:, :1])


def stops_ms(space: DesignSpace, step_ms: float) -> FloatArray:
    """The ISIs of a sweep from the first one on [ms], shape (t,); steps are multiples of the space's own."""
    if space.isis_ms:
        stops_ms = [space.isis_ms[0]]
        stops_ms += [i for i in space.isis_ms if i - stops_ms[-1] >= step_ms - 1e-9]
        return np.array(stops_ms)
    whole_ms = space.step_ms * math.ceil(step_ms / space.step_ms - 1e-9)
    stops = math.floor((space.high_ms - space.low_ms) / whole_ms + 1e-9) + 1
    isis_ms: FloatArray = space.low_ms + whole_ms * np.arange(stops, dtype=np.float64)
    return isis_ms
