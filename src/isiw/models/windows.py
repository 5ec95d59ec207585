"""From sampled windows to an estimate: the reported window is the one of largest expected F1."""

from __future__ import annotations

from typing import NamedTuple

from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.protocol import Tensor
from isiw.types import FloatArray
from isiw.window import (
    EDGE_LEVEL,
    MIN_EXCESS_MV,
    MIN_EXCESS_OF_BASELINE,
    BestISI,
    Enhancement,
    Window,
    WindowEstimate,
)

__all__ = [
    "EXCLUDED_AT",
    "PROFILE_POINTS",
    "SampledHypotheses",
    "SampledProfiles",
    "best_window",
    "edge_samples",
    "ends",
    "least_excess_mv",
    "profile_grid",
    "sampled_estimate",
]

PROFILE_POINTS = 101
"""ISIs at which the expected MEP and its band are reported, at least."""

PROFILE_STEP_MS = 4.0
"""They are no further apart than this, where the space has ISIs between them: narrow peaks are 20 ms wide."""


def least_excess_mv(peak_mv: Tensor, baseline_mv: Tensor) -> Tensor:
    """The least-excess rule of `isiw.window.least_excess_mv`, for tensors.

    Args:
        peak_mv: largest excess over the baseline in the range [mV], any shape.
        baseline_mv: expected MEP without a tap [mV], of the same shape.
    """
    enough_mv = (MIN_EXCESS_OF_BASELINE * baseline_mv).clamp_min(MIN_EXCESS_MV)
    return torch.where(peak_mv >= enough_mv, EDGE_LEVEL * peak_mv, torch.inf)


EXCLUDED_AT = 0.9
"""With which probability `WindowEstimate.largest_excluded` is larger than the largest enhancement."""


def best_window(masks: Tensor, grid_ms: FloatArray) -> tuple[Window | None, float]:
    """The window of largest expected F1 among the level sets of the posterior's membership, and that F1.

    Args:
        masks: sampled windows as 0 or 1, shape (s, t); none of them empty.
        grid_ms: ISIs of the masks [ms], shape (t,).
    """
    membership = masks.mean(0)
    cuts = torch.linspace(0.1, 0.9, 17, dtype=torch.float32, device=masks.device) * membership.max()
    candidates = (membership >= cuts.unsqueeze(-1)).to(masks.dtype)
    overlap = candidates @ masks.T
    sizes = candidates.sum(-1, keepdim=True) + masks.sum(-1)
    expected_f1, best = (2.0 * overlap / sizes).mean(-1).max(-1)
    return Window.from_mask(grid_ms, candidates[best].cpu().numpy() > 0), float(expected_f1)


def ends(masks: Tensor) -> tuple[Tensor, Tensor]:
    """Grid index of the start and of the end of sampled windows, each of shape (s,).

    Args:
        masks: sampled windows as 0 or 1, shape (s, t); none of them empty.
    """
    points = masks.shape[-1]
    rising = torch.arange(1.0, points + 1.0, dtype=torch.float32, device=masks.device)
    # A largest product is found much faster than the place of the first 1.
    last, first = ((masks * weights).amax(-1).long() for weights in (rising, rising.flip(0)))
    return points - first, last - 1


def edge_samples(first: Tensor, last: Tensor, space: DesignSpace) -> Tensor:
    """Start and end of sampled windows [ms], ±inf where a window runs out of the range, shape (s, 2).

    Args:
        first: grid index of the start, shape (s,).
        last: grid index of the end, shape (s,).
        space: the design space.
    """
    grid = torch.tensor(space.grid_ms, dtype=torch.float32, device=first.device)
    start = torch.where(first == 0, -torch.inf, grid[first])
    end = torch.where(last == len(grid) - 1, torch.inf, grid[last])
    return torch.stack((start, end), dim=-1)


def profile_grid(space: DesignSpace) -> Tensor:
    """The ISIs at which profiles are reported [ms], shape (t,)."""
    every = max(1, min(len(space.grid_ms) // PROFILE_POINTS, int(PROFILE_STEP_MS / space.step_ms)))
    return torch.tensor(sorted({*space.grid_ms[::every], space.grid_ms[-1]}), dtype=torch.float32)


class SampledProfiles(NamedTuple):
    """Sampled profiles of one person.

    Args:
        mep_mv: expected MEP at the ISIs of `profile_grid` [mV], shape (s, t).
        baseline_mv: expected MEP without a tap [mV], shape (s,).
    """

    mep_mv: Tensor
    baseline_mv: Tensor

    @property
    def excess_mv(self) -> Tensor:
        """Largest enhancement at any ISI [mV], shape (s,)."""
        return (self.mep_mv.amax(-1) - self.baseline_mv).clamp_min(0.0)


class SampledHypotheses(NamedTuple):
    """Which of a model's hypotheses sampled windows belong to.

    Args:
        kinds: an index of the names for each sample, shape (s,).
        names: what the hypotheses are called.
    """

    kinds: Tensor
    names: tuple[str, ...]


def sampled_estimate(
    masks: Tensor, profiles: SampledProfiles, space: DesignSpace, hypotheses: SampledHypotheses | None = None
) -> WindowEstimate:
    """What equally weighted samples say about the window of one person.

    Args:
        masks: sampled windows on the space's grid as 0 or 1, all 0 where there is none, shape (s, t).
        profiles: sampled profiles, of the same or of other samples.
        space: the design space.
        hypotheses: of the sampled windows; None where the model has none.
    """
    somewhere = masks.sum(-1) > 0
    present = masks[somewhere]
    probability = len(present) / len(masks)
    first, last = ends(present)
    edges = edge_samples(first, last, space)
    start, end = edges.median(0).values.tolist() if len(present) else (None, None)
    reported, f1 = best_window(present, space.grid_ms) if probability >= 0.5 else (None, 1.0)
    levels = torch.tensor([0.05, 0.5, 0.95], dtype=profiles.mep_mv.dtype, device=profiles.mep_mv.device)
    return WindowEstimate(
        probability=probability,
        window=reported,
        start_ms=start,
        end_ms=end,
        grid_ms=profile_grid(space).double().numpy(),
        edge_samples_ms=edges.double().cpu().numpy(),
        profile_quantiles_mv=torch.quantile(profiles.mep_mv, levels, dim=0).double().cpu().numpy(),
        split_probability=float((present.sum(-1) <= last - first).double().mean()) if len(present) else None,
        hypothesis_samples=None if hypotheses is None else hypotheses.kinds[somewhere].cpu().numpy(),
        hypothesis_names=() if hypotheses is None else hypotheses.names,
        expected_f1=f1 * (1.0 - probability if reported is None else probability),
        best_isi=_best_isi(profiles, space),
        largest_excluded=Enhancement(float(torch.quantile(profiles.excess_mv, EXCLUDED_AT))),
    )


def _best_isi(profiles: SampledProfiles, space: DesignSpace) -> BestISI | None:
    enhanced = least_excess_mv(profiles.excess_mv, profiles.baseline_mv).isfinite()
    if not bool(enhanced.any()):
        return None
    isi_ms = profile_grid(space).to(enhanced.device)[profiles.mep_mv[enhanced].argmax(-1)]
    levels = torch.tensor([0.05, 0.5, 0.95], dtype=isi_ms.dtype, device=isi_ms.device)
    low, median, high = torch.quantile(isi_ms, levels).tolist()
    return BestISI(median, low, high)
