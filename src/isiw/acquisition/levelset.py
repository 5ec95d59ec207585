"""Acquisition functions for level sets: ask where it is least clear on which side of the window's edge an ISI lies.

The level is that of the least-excess rule, and so is uncertain itself: each posterior sample has a margin, by which its
expected MEP exceeds the share `EDGE_LEVEL` of its own largest excess over its own baseline. Straddle: [Bryan2005].
Expected feasibility: [Bichon2008], here integrated over the range and one step ahead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from isiw.acquisition.protocol import ForeseesProfiles
from isiw.acquisition.twostep import lookahead
from isiw.checks import Checked, Positive
from isiw.excess import EDGE_LEVEL
from isiw.lazy import scipy
from isiw.models.protocol import PredictsOutcomes, SamplesProfiles
from isiw.types import Array

_INV_SQRT_2PI = 0.3989422804014327


def _margins_mv(posterior: SamplesProfiles, isi_ms: Array) -> Array:
    """By how much each sample is above the level of its window's edge [mV], shape (b, s, t)."""
    excess = posterior.profiles_mv(isi_ms) - posterior.baselines_mv()[..., None]
    margins: Array = excess - EDGE_LEVEL * np.maximum(excess.max(axis=-1, keepdims=True), 0.0)
    return margins


def expected_feasibility(mean: Array, sd: Array, band_sd: float = 2.0) -> Array:
    """Expected depth inside a band of `band_sd` SDs around the level, of a Gaussian margin."""
    z = mean / np.maximum(sd, 1e-12)
    low, high = -band_sd - z, band_sd - z
    below, at, above = (scipy.special.ndtr(x) for x in (low, -z, high))
    inside = band_sd * (above - below)
    # By parts: the expected distance from the level, where the margin is inside the band.
    distance = z * (below + above - 2.0 * at) + 2.0 * _density(z) - _density(low) - _density(high)
    feasibility: Array = sd * (inside - distance)
    return feasibility


def _density(z: Array) -> Array:
    """Of a standard Gaussian."""
    density: Array = _INV_SQRT_2PI * np.exp(-0.5 * np.square(z))
    return density


@dataclass(frozen=True)
class Straddle(Checked):
    """Ask where the margin's credible interval reaches furthest across the edge's level.

    Args:
        width_sd: half the interval's width [SD]; larger explores more.
    """

    width_sd: Positive = 1.96
    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: SamplesProfiles, isi_ms: Array) -> Array:
        """The reach of the margin's credible interval across zero [mV], shape (b, t)."""
        margins = _margins_mv(posterior, isi_ms)
        reach: Array = self.width_sd * margins.std(axis=1) - np.abs(margins.mean(axis=1))
        return reach


@dataclass(frozen=True)
class IntegratedFeasibility(Checked):
    """Ask what is expected to leave the fewest ISIs near the edge's level.

    Args:
        band_sd: half the width of the band around the level [SD].
    """

    band_sd: Positive = 2.0
    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesProfiles)

    def __call__(self, posterior: ForeseesProfiles, isi_ms: Array) -> Array:
        """By how much the next MEP is expected to reduce the summed expected feasibility [mV], shape (b, t)."""
        margins = _margins_mv(posterior, isi_ms)
        centre = margins.mean(axis=1, keepdims=True)
        now = expected_feasibility(centre[:, 0], margins.std(axis=1), self.band_sd).sum(-1, keepdims=True)
        offset = margins - centre
        ahead = lookahead(posterior.outcome_mass(isi_ms), np.concatenate((offset, np.square(offset)), axis=-1))
        first, second = np.split(ahead.mean, 2, axis=-1)
        left_sd = np.sqrt(np.maximum(second - np.square(first), 0.0))
        later = expected_feasibility(centre[:, None] + first, left_sd, self.band_sd).sum(-1)
        gain: Array = now - (ahead.probability * later).sum(-1)
        return gain
