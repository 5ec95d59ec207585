import math
from dataclasses import replace
from typing import Any

import pytest
import torch

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.parametric.law import FloorPrior, InputNoisePrior, Likelihood, Unknowns, WindowPrior, latent_names
from isiw.models.shared.scales import Scale


def drawn(likelihood: Likelihood, space: DesignSpace, prior: WindowPrior | None = None) -> Unknowns:
    latents = torch.randn(
        (20_000, len(latent_names(likelihood))), generator=torch.Generator().manual_seed(1), dtype=torch.double
    )
    return (prior or WindowPrior()).unknowns(latents, likelihood, space)


@pytest.mark.parametrize(("space", "shift_ms"), [(IMPACT_SPACE, 0.0), (VALVE_SPACE, 180.0)], ids=["impact", "valve"])
def test_windows_start_up_to_an_eighth_of_a_second_after_the_impact_or_rarely_anywhere(
    space: DesignSpace, shift_ms: float
) -> None:
    # One in five lies anywhere in the range, or up to 100 ms before it; some of these near the usual ones.
    prior = WindowPrior(start=replace(WindowPrior().start, hit_delay_ms=(180.0, 6.0)))
    start_ms = drawn("gamma", space, prior).start_ms
    inside = (start_ms > shift_ms - 15) & (start_ms < shift_ms + 125 + 15)
    assert 0.8 < inside.double().mean() < 0.92
    assert start_ms.min() >= space.low_ms - 100
    assert start_ms.max() <= space.high_ms


def test_widths_and_floors_have_the_medians_and_spreads_that_are_set() -> None:
    prior = WindowPrior(width_ms=Scale(80.0, 0.3), floor=FloorPrior(mean_mv=Scale(0.02, 0.5)))
    unknowns = drawn("log-normal", VALVE_SPACE, prior)
    for values, (median, log_sd) in ((unknowns.width_ms, (80.0, 0.3)), (unknowns.floor_mv, (0.02, 0.5))):
        assert values.median().item() == pytest.approx(median, rel=0.03)
        assert values.log().std().item() == pytest.approx(log_sd, rel=0.03)


def test_with_noise_on_the_input_the_expected_mep_saturates_and_tms_alone_evokes_a_little() -> None:
    unknowns = drawn("input-noise", VALVE_SPACE)
    evoked_mv = unknowns.baseline_mv - unknowns.floor_mv
    assert (evoked_mv > 0).all()
    assert (unknowns.amplitude_mv > 0).all()
    assert (evoked_mv + unknowns.amplitude_mv <= unknowns.saturation_mv * (1 + 1e-9)).all()
    # Peaks of the dissertation's people: 0.03-0.3 mV.
    assert 0.03 < (unknowns.baseline_mv + unknowns.amplitude_mv).median().item() < 0.15


@pytest.mark.parametrize("wrong", [{"p_window": 0.0}, {"width_ms": (0.0, 0.4)}, {"outliers": (-3.5, 0.0)}])
def test_an_invalid_prior_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        WindowPrior(**wrong)


@pytest.mark.parametrize(
    ("part", "wrong"), [(FloorPrior, {"mean_mv": (math.nan, 0.4)}), (InputNoisePrior, {"rest": (-2.7, 0.0)})]
)
def test_an_impossible_part_is_refused(part: type, wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        part(**wrong)
