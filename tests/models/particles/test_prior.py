from dataclasses import astuple, fields, replace
from typing import Any

import pytest
import torch

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import (
    LATENTS,
    AllOrNonePrior,
    FloorPrior,
    GainPrior,
    NoiseShares,
    Person,
    Prior,
    ProfilePrior,
    SessionPrior,
    ShapeShares,
    block,
)
from isiw.models.particles.shapes import ShapeKind

MANY = 20_000


def people(prior: Prior, space: DesignSpace) -> Person:
    generator = torch.Generator().manual_seed(1)
    return prior.person(prior.sample(1, MANY, generator), space)


def test_kinds_come_as_often_as_the_prior_says() -> None:
    prior = Prior()
    person = people(prior, VALVE_SPACE)
    for kinds, named in ((person.shape.kind, prior.profile.shapes), (person.response.kind, prior.noise)):
        probabilities = astuple(named)
        shares = torch.bincount(kinds[0], minlength=len(probabilities)) / MANY
        assert (shares - torch.tensor(probabilities)).abs().max() < 0.015
    assert person.present.float().mean().item() == pytest.approx(prior.profile.p_window, abs=0.012)


@pytest.mark.parametrize(
    ("part", "wrong"),
    [
        (ProfilePrior, {"p_window": 2.0}),
        (ProfilePrior, {"width_ms": (float("nan"), 0.5, 0.0)}),
        (GainPrior, {"cv": (0.0, 0.3)}),
        (AllOrNonePrior, {"max_probability": (0.0, -1.0)}),
        (FloorPrior, {"median_mv": (0.009, 0.0)}),
        (SessionPrior, {"drift_sd": -0.1}),
        (SessionPrior, {"startup": (0.5, -0.5)}),
    ],
)
def test_an_impossible_part_is_refused(part: type, wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        part(**wrong)


@pytest.mark.parametrize("wrong", [{"boost": (3.0, 0.0, 0.1)}, {"rest": (-4.5, 0.4, -0.1)}, {"ratio": (-1.0, 0.9)}])
def test_an_impossible_muscle_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        replace(Prior().hand, **wrong)


@pytest.mark.parametrize("shares", [ShapeShares, NoiseShares])
def test_shares_sum_to_one(shares: type[ShapeShares] | type[NoiseShares]) -> None:
    first = fields(shares)[0].name
    with pytest.raises(InvalidValueError, match="sum to 1"):
        shares(**{first: 1.0})
    with pytest.raises(InvalidValueError, match=first):
        shares(**{first: -0.2})


def test_every_kind_has_its_share_in_the_order_of_the_kinds() -> None:
    assert [f.name for f in fields(ShapeShares)] == [kind.name.lower() for kind in ShapeKind]
    assert [f.name for f in fields(NoiseShares)] == [kind.name.lower() for kind in NoiseKind]


def test_blocks_of_latents_are_named() -> None:
    chosen = block("place", "form", device=torch.device("cpu"))
    names = [name for name, inside in zip(LATENTS, chosen.tolist(), strict=True) if inside]
    assert names == ["start", "width", "form"]


def test_most_forearms_are_usual_and_the_tail_reaches_the_others() -> None:
    # Half of all lie within 0.68 SDs of the median, as without a tail.
    prior = Prior()
    response = people(prior, VALVE_SPACE).response
    rest = response.rest[0][response.kind[0] == NoiseKind.FOREARM]
    assert (rest - prior.forearm.rest.median).abs().median().item() == pytest.approx(
        0.68 * prior.forearm.rest.sd, rel=0.1
    )
    assert 0.001 < (rest < -6.2).float().mean().item() < 0.03


def test_hands_reach_from_small_meps_to_large_ones_at_threshold_and_below() -> None:
    # A of 0.2 and 3 mV over a floor of 0.009 mV; k = 0.23 times 90 % and 100 % RMT less an x50 of 117 %.
    response = people(Prior(noise=NoiseShares(0.0, 0.0, 0.0, 0.0, 1.0)), VALVE_SPACE).response
    largest, drives = response.log_ratio.exp(), response.rest
    for values, (low, high) in (
        (largest, (0.2 / 0.009, 3.0 / 0.009)),
        (drives, (0.23 * (90 - 117), 0.23 * (100 - 117))),
    ):
        for rare in (values < low, values > high):
            assert 0.02 < rare.float().mean().item() < 0.25
