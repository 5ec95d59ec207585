"""Acquisition functions based on variance: of the profile at one ISI, of the whole profile, and of the edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from isiw.acquisition.protocol import ForeseesProfiles, ForeseesWindows
from isiw.acquisition.twostep import expected_variance_reduction
from isiw.models.protocol import PredictsOutcomes, SamplesProfiles, SamplesWindows
from isiw.types import Array


@dataclass(frozen=True)
class ProfileVariance:
    """Posterior variance of the expected MEP: ask where the profile is least known."""

    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: SamplesProfiles, isi_ms: Array) -> Array:
        """The variance at each ISI [mV²], shape (b, t)."""
        variance: Array = posterior.profiles_mv(isi_ms).var(axis=1)
        return variance


@dataclass(frozen=True)
class IntegratedVariance:
    """Expected reduction of the integrated posterior variance: ask what says most about the whole profile.

    It is qNIPV of BoTorch with one point [Seo2000], for any posterior.
    """

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesProfiles)

    def __call__(self, posterior: ForeseesProfiles, isi_ms: Array) -> Array:
        """Expected reduction of the profile's variance, summed over the candidates [mV²], shape (b, t)."""
        return expected_variance_reduction(posterior.outcome_mass(isi_ms), posterior.profiles_mv(isi_ms))


@dataclass(frozen=True)
class EdgeVariance:
    """Expected reduction of the summed variance of start and end of the window, given that there is one.

    Edges are counted in candidates, so that the score does not depend on the range; an edge beyond the range counts as
    its last ISI.
    """

    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesWindows)

    def __call__(self, posterior: ForeseesWindows, isi_ms: Array) -> Array:
        """Score the candidate ISIs, shape (b, t)."""
        masks = posterior.window_masks(isi_ms)
        ends = masks.argmax(-1), masks.shape[-1] - 1 - masks[..., ::-1].argmax(-1)
        edges, found = np.stack(ends, axis=-1).astype(masks.dtype), masks.max(-1, keepdims=True) > 0
        # Samples without a window have no edges, and are left out.
        count = np.maximum(found.sum(axis=1, keepdims=True, dtype=masks.dtype), 1)
        mean = np.where(found, edges, 0.0).sum(axis=1, keepdims=True) / count
        centred = np.where(found, edges - mean, 0.0)
        mass = posterior.outcome_mass(isi_ms) * found[..., None]
        return expected_variance_reduction(mass, centred)
