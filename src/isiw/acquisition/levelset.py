"""Acquisition functions for level sets: ask where it is least clear on which side of the window's edge an ISI lies.

The level is that of the least-excess rule, and so is uncertain itself: each posterior sample has a margin, by which its
expected MEP exceeds the share `EDGE_LEVEL` of its own largest excess over its own baseline. Straddle: [Bryan2005].
Expected feasibility: [Bichon2008], here integrated over the range and one step ahead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from isiw.acquisition.protocol import ForeseesProfiles
from isiw.acquisition.twostep import lookahead
from isiw.checks import Checked, Positive
from isiw.lazy import torch
from isiw.models.protocol import PredictsOutcomes, SamplesProfiles, Tensor
from isiw.window import EDGE_LEVEL

_INV_SQRT_2PI = 0.3989422804014327


def _margins_mv(posterior: SamplesProfiles, isi_ms: Tensor) -> Tensor:
    """By how much each sample is above the level of its window's edge [mV], shape (b, s, t)."""
    excess = posterior.profiles_mv(isi_ms) - posterior.baselines_mv().unsqueeze(-1)
    return excess - EDGE_LEVEL * excess.amax(dim=-1, keepdim=True).clamp_min(0.0)


def expected_feasibility(mean: Tensor, sd: Tensor, band_sd: float = 2.0) -> Tensor:
    """Expected depth inside a band of `band_sd` SDs around the level, of a Gaussian margin."""
    z = mean / sd.clamp_min(1e-12)
    low, high = -band_sd - z, band_sd - z
    below, at, above = (torch.special.ndtr(x) for x in (low, -z, high))
    inside = band_sd * (above - below)
    # By parts: the expected distance from the level, where the margin is inside the band.
    distance = z * (below + above - 2.0 * at) + 2.0 * _density(z) - _density(low) - _density(high)
    feasibility: Tensor = sd * (inside - distance)
    return feasibility


def _density(z: Tensor) -> Tensor:
    """Of a standard Gaussian."""
    return _INV_SQRT_2PI * torch.exp(-0.5 * z.square())


@dataclass(frozen=True)
class Straddle(Checked):
    """Ask where the margin's credible interval reaches furthest across the edge's level.

    Args:
        width_sd: half the interval's width [SD]; larger explores more.
    """

    width_sd: Positive = 1.96
    needs: ClassVar[tuple[type, ...]] = (SamplesProfiles,)

    def __call__(self, posterior: SamplesProfiles, isi_ms: Tensor) -> Tensor:
        """The reach of the margin's credible interval across zero [mV], shape (b, t)."""
        margins = _margins_mv(posterior, isi_ms)
        return self.width_sd * margins.std(dim=1, correction=0) - margins.mean(dim=1).abs()


@dataclass(frozen=True)
class IntegratedFeasibility(Checked):
    """Ask what is expected to leave the fewest ISIs near the edge's level.

    Args:
        band_sd: half the width of the band around the level [SD].
    """

    band_sd: Positive = 2.0
    needs: ClassVar[tuple[type, ...]] = (PredictsOutcomes, SamplesProfiles)

    def __call__(self, posterior: ForeseesProfiles, isi_ms: Tensor) -> Tensor:
        """By how much the next MEP is expected to reduce the summed expected feasibility [mV], shape (b, t)."""
        margins = _margins_mv(posterior, isi_ms)
        mean, sd = margins.mean(dim=1), margins.std(dim=1, correction=0)
        now = expected_feasibility(mean, sd, self.band_sd).sum(-1, keepdim=True)
        centre = margins.mean(dim=1, keepdim=True)
        offset = margins - centre
        ahead = lookahead(posterior.outcome_mass(isi_ms), torch.cat((offset, offset.square()), dim=-1))
        first, second = ahead.mean.chunk(2, dim=-1)
        left_sd = (second - first.square()).clamp_min(0.0).sqrt()
        later = expected_feasibility(centre.unsqueeze(1) + first, left_sd, self.band_sd).sum(-1)
        return now - (ahead.probability * later).sum(-1)
