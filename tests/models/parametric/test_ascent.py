import torch

from isiw.models.parametric.importance import find_modes
from isiw.models.parametric.tensors import Tensor

FAR = torch.tensor([[3.0, 0.0, 0.0], [-3.0, 0.5, 0.0]], dtype=torch.double)
PRECISIONS = torch.diag_embed(torch.tensor([[9.0, 4.0, 1.0], [4.0, 1.0, 2.0]], dtype=torch.double))


def two_peaks(points: Tensor) -> Tensor:
    off = points.unsqueeze(0) - FAR.unsqueeze(1)
    heights = -0.5 * torch.einsum("kmi,kij,kmj->km", off, PRECISIONS, off)
    return torch.logsumexp(heights + torch.tensor([[0.0], [1.0]], dtype=torch.double), dim=0)


def starts(n: int) -> Tensor:
    return 2.0 * torch.randn((n, 3), generator=torch.Generator().manual_seed(1), dtype=torch.double)


def test_all_modes_are_found_the_best_first_with_their_curvatures() -> None:
    modes = find_modes(two_peaks, starts(12), steps=40)
    assert len(modes.points) == 2
    # The second is e times as high and sqrt(36 / 8) times as wide.
    torch.testing.assert_close(modes.points, FAR.flip(0), atol=0.05, rtol=0.0)
    torch.testing.assert_close(modes.covariances, PRECISIONS.inverse().flip(0), atol=1e-3, rtol=0.0)
    gap = modes.log_evidence[0] - modes.log_evidence[1]
    assert abs(gap.item() - (1.0 + 0.5 * torch.log(torch.tensor(36.0 / 8.0)).item())) < 0.02


def test_a_mode_that_is_reached_twice_counts_once() -> None:
    modes = find_modes(lambda points: -0.5 * points.square().sum(-1), starts(8), steps=30)
    assert len(modes.points) == 1


def test_a_density_with_a_hole_gives_modes_that_can_be_used() -> None:
    def holed(points: Tensor) -> Tensor:
        return torch.where(points[:, 0] > 1.0, torch.nan, -0.5 * points.square().sum(-1))

    modes = find_modes(holed, torch.tensor([[0.9, 0.0, 0.0], [2.0, 0.0, 0.0]], dtype=torch.double), steps=10)
    assert modes.covariances.isfinite().all()
    assert torch.linalg.eigvalsh(modes.covariances).min() > 0
