"""From sampled windows to an estimate: the reported window is the one of largest expected F1."""

from __future__ import annotations

import torch

from isiw.design import DesignSpace
from isiw.models.protocol import Tensor
from isiw.types import FloatArray
from isiw.window import Window

__all__ = ["best_window", "edge_samples"]


def best_window(masks: Tensor, grid_ms: FloatArray) -> Window | None:
    """The window of largest expected F1 among the level sets of the posterior's membership.

    Args:
        masks: sampled windows as 0 or 1, shape (s, t); none of them empty.
        grid_ms: ISIs of the masks [ms], shape (t,).
    """
    membership = masks.mean(0)
    cuts = torch.linspace(0.1, 0.9, 17, device=masks.device) * membership.max()
    candidates = (membership >= cuts.unsqueeze(-1)).to(masks.dtype)
    overlap = candidates @ masks.T
    sizes = candidates.sum(-1, keepdim=True) + masks.sum(-1)
    expected_f1 = (2.0 * overlap / sizes).mean(-1)
    return Window.from_mask(grid_ms, candidates[expected_f1.argmax()].cpu().numpy() > 0)


def edge_samples(masks: Tensor, space: DesignSpace) -> Tensor:
    """Start and end of sampled windows [ms], ±inf where a window runs out of the range, shape (s, 2).

    Args:
        masks: sampled windows on the space's grid as 0 or 1, shape (s, t); none of them empty.
        space: the design space.
    """
    grid = torch.tensor(space.grid_ms, dtype=masks.dtype, device=masks.device)
    first = masks.argmax(-1)
    last = masks.shape[-1] - 1 - masks.flip(-1).argmax(-1)
    start = torch.where(first == 0, -torch.inf, grid[first])
    end = torch.where(last == masks.shape[-1] - 1, torch.inf, grid[last])
    return torch.stack((start, end), dim=-1)
