import pytest
import torch

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.beliefs import prior_with
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import Prior

MANY = 20_000


def people(prior: Prior, space: DesignSpace):
    generator = torch.Generator().manual_seed(1)
    return prior.person(prior.sample(1, MANY, generator), space)


@pytest.mark.parametrize(("space", "low_ms", "high_ms"), [(IMPACT_SPACE, 0.0, 125.0), (VALVE_SPACE, 180.0, 305.0)])
def test_windows_start_soon_after_the_impact_and_sometimes_anywhere(
    space: DesignSpace, low_ms: float, high_ms: float
) -> None:
    start = people(Prior(p_anywhere=0.2), space).shape.start_ms[0]
    near = ((start > low_ms - 15) & (start < high_ms + 15)).float().mean().item()
    elsewhere = 0.2 * (1 - (high_ms - low_ms + 30) / (space.high_ms - space.low_ms + 50))
    assert near == pytest.approx(1 - elsewhere, abs=0.02)
    assert (start >= space.low_ms - 50).all()
    assert (start <= space.high_ms).all()


def test_a_prior_that_trusts_no_stimulator_is_even_over_the_range() -> None:
    start = people(Prior(p_anywhere=1.0), VALVE_SPACE).shape.start_ms[0]
    shares = torch.histc(start, 5, min=-50.0, max=500.0) / MANY
    assert (shares - 0.2).abs().max() < 0.02  # three SDs of a share are 0.009


@pytest.mark.parametrize("space", [DesignSpace(400, 900, reference="valve"), DesignSpace(200, 400)])
def test_where_no_start_is_expected_all_are_as_likely(space: DesignSpace) -> None:
    start = people(Prior(), space).shape.start_ms[0]
    shares = torch.histc(start, 5, min=space.low_ms - 50, max=space.high_ms) / MANY
    assert (shares - 0.2).abs().max() < 0.02


def test_a_range_with_a_part_of_the_usual_starts_has_only_their_share_of_them() -> None:
    space = DesignSpace(115, 315)  # of the usual starts, 0 to 115 ms, its 50 ms margin holds 50 / 115
    start = people(Prior(p_anywhere=0.5), space).shape.start_ms[0]
    usual = 0.5 * 50 / 115
    in_margin = (usual + 0.5 * 50 / 250) / (usual + 0.5)
    assert (start < 115).float().mean().item() == pytest.approx(in_margin, abs=0.015)


def test_kinds_come_as_often_as_the_prior_says() -> None:
    prior = Prior()
    person = people(prior, VALVE_SPACE)
    for kinds, probabilities in ((person.shape.kind, prior.p_shape), (person.response.kind, prior.p_noise)):
        shares = torch.bincount(kinds[0], minlength=len(probabilities)) / MANY
        assert (shares - torch.tensor(probabilities)).abs().max() < 0.015
    assert person.present.float().mean().item() == pytest.approx(prior.p_window, abs=0.012)


def test_a_prior_is_made_from_what_a_configuration_holds() -> None:
    prior = prior_with({"p_window": 0.7, "width_ms": [80.0, 0.3, 0.0]}, Prior)
    assert prior == Prior(p_window=0.7, width_ms=(80.0, 0.3, 0.0))


@pytest.mark.parametrize(
    "wrong",
    [
        {"p_window": 2.0},
        {"p_hand": -0.1},
        {"p_anywhere": float("nan")},
        {"p_shape": (0.5, 0.5)},
        {"p_noise": (0.5, 0.3, 0.2)},
        {"p_noise": (0.5, 0.2, 0.1, 0.1)},
        {"p_noise": (1.2, -0.2, 0.0, 0.0)},
        {"width_ms": (float("nan"), 0.5, 0.0)},
        {"width_ms": (80.0, 0.3)},
        {"boost": (3.0, 0.0, 0.1)},
        {"boost": (0.0, 0.3, 0.1)},
        {"rest": (-4.5, 0.4, -0.1)},
        {"hand_rest": (-4.7, 0.0, 0.0)},
        {"hand_ratio": (-1.0, 0.9, 0.0)},
        {"hit_delay_ms": (180.0, 0.0)},
        {"start_ms": (100.0, 5.0)},
    ],
)
def test_a_prior_that_cannot_be_is_refused(wrong) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        Prior(**wrong)


def test_a_setting_that_the_prior_does_not_have_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="p_windov"):
        prior_with({"p_windov": 0.5}, Prior)


def test_most_forearms_are_usual_and_the_tail_reaches_the_others() -> None:
    # Half of all lie within 0.68 SDs of the median, as without a tail.
    prior = Prior(p_hand=0.0)
    response = people(prior, VALVE_SPACE).response
    rest = response.rest[0][response.kind[0] == NoiseKind.RECRUITMENT]
    assert (rest - prior.rest[0]).abs().median().item() == pytest.approx(0.68 * prior.rest[1], rel=0.1)
    assert 0.001 < (rest < -6.2).float().mean().item() < 0.03


def test_hands_reach_from_small_meps_to_large_ones_at_threshold_and_below() -> None:
    # A of 0.2 and 3 mV over a floor of 0.009 mV; k = 0.23 times 90 % and 100 % RMT less an x50 of 117 %.
    response = people(Prior(p_noise=(0.0, 0.0, 1.0, 0.0), p_hand=1.0), VALVE_SPACE).response
    largest, drives = response.log_ratio.exp(), response.rest
    for values, (low, high) in (
        (largest, (0.2 / 0.009, 3.0 / 0.009)),
        (drives, (0.23 * (90 - 117), 0.23 * (100 - 117))),
    ):
        for rare in (values < low, values > high):
            assert 0.02 < rare.float().mean().item() < 0.25
