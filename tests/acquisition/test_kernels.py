import numpy as np
import pytest
import torch

from isiw.acquisition.information import MutualInformation, WindowGain
from isiw.models.protocol import Tensor


class Believed:
    """Random predictive distributions, and windows of none, one or two runs; in single or in double precision."""

    trials = 4

    def __init__(self, dtype: torch.dtype) -> None:
        draws = torch.Generator().manual_seed(1)
        mass = torch.rand((2, 60, 11, 7), generator=draws) ** 6
        self.mass: Tensor = (mass / mass.sum(-1, keepdim=True)).to(dtype)
        first, width = torch.randint(-3, 9, (2, 2, 60, 2, 1), generator=draws)
        isi = torch.arange(11)
        self.masks: Tensor = ((isi >= first) & (isi < first + width)).any(-2).to(dtype)

    def estimate(self, person: int = 0) -> None: ...

    def outcome_mass(self, isi_ms: Tensor) -> Tensor:
        del isi_ms
        return self.mass

    def window_masks(self, isi_ms: Tensor) -> Tensor:
        del isi_ms
        return self.masks


@pytest.mark.parametrize("score", [MutualInformation(), WindowGain()])
def test_scores_in_single_precision_are_those_in_double(score) -> None:  # type: ignore[no-untyped-def]
    ours, theirs = (score(Believed(dtype), torch.arange(11.0)) for dtype in (torch.float32, torch.float64))
    assert ours.shape == (2, 11)
    np.testing.assert_allclose(ours, theirs, atol=3e-6)
