"""Where windows start, as believed."""

from __future__ import annotations

from typing import Any

import pytest
import torch

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.shared.start import StartPrior

MANY = 20_000


def starts_ms(prior: StartPrior, space: DesignSpace) -> torch.Tensor:
    return prior.start_ms(torch.randn(MANY, generator=torch.Generator().manual_seed(1)), space)


@pytest.mark.parametrize(("space", "low_ms", "high_ms"), [(IMPACT_SPACE, 0.0, 125.0), (VALVE_SPACE, 180.0, 305.0)])
def test_windows_start_soon_after_the_impact_and_sometimes_anywhere(
    space: DesignSpace, low_ms: float, high_ms: float
) -> None:
    start = starts_ms(StartPrior(p_anywhere=0.2), space)
    near = ((start > low_ms - 15) & (start < high_ms + 15)).float().mean().item()
    elsewhere = 0.2 * (1 - (high_ms - low_ms + 30) / (space.high_ms - space.low_ms + 50))
    assert near == pytest.approx(1 - elsewhere, abs=0.02)
    assert (start >= space.low_ms - 50).all()
    assert (start <= space.high_ms).all()


def test_a_prior_that_trusts_no_stimulator_is_even_over_the_range() -> None:
    start = starts_ms(StartPrior(p_anywhere=1.0), VALVE_SPACE)
    shares = torch.histc(start, 5, min=-50.0, max=500.0) / MANY
    assert (shares - 0.2).abs().max() < 0.02  # three SDs of a share are 0.009


@pytest.mark.parametrize("space", [DesignSpace(400, 900, reference="valve"), DesignSpace(200, 400)])
def test_where_no_start_is_expected_all_are_as_likely(space: DesignSpace) -> None:
    start = starts_ms(StartPrior(), space)
    shares = torch.histc(start, 5, min=space.low_ms - 50, max=space.high_ms) / MANY
    assert (shares - 0.2).abs().max() < 0.02


def test_a_range_with_a_part_of_the_usual_starts_has_only_their_share_of_them() -> None:
    space = DesignSpace(115, 315)  # of the usual starts, 0 to 115 ms, its 50 ms margin holds 50 / 115
    start = starts_ms(StartPrior(p_anywhere=0.5), space)
    usual = 0.5 * 50 / 115
    in_margin = (usual + 0.5 * 50 / 250) / (usual + 0.5)
    assert (start < 115).float().mean().item() == pytest.approx(in_margin, abs=0.015)


def test_later_latents_are_later_starts() -> None:
    assert (StartPrior().start_ms(torch.linspace(-4, 4, 100), VALVE_SPACE).diff() >= 0).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"p_anywhere": float("nan")},
        {"p_anywhere": 1.5},
        {"hit_delay_ms": (180.0, 0.0)},
        {"after_impact_ms": (100.0, 5.0)},
        {"after_impact_ms": (50.0, 50.0)},
    ],
)
def test_an_impossible_prior_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        StartPrior(**wrong)
