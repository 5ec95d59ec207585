"""Places: windows that earlier sessions lead one to expect."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import softmax
from scipy.stats import norm

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.particles import ParticleModel
from isiw.models.particles.places import Place
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.models.shared.scales import Scale
from isiw.models.shared.start import StartPrior
from isiw.priors.population import beside
from isiw.types import Singles
from native.drawn import Case

MANY = 20_000
HERE = Place(0.5, Scale(150.0, 5.0), Scale(60.0, 0.1))
THERE = Place(0.2, Scale(320.0, 5.0), Scale(140.0, 0.1))


def prior_with(*places: Place) -> Prior:
    usual = Prior()
    return replace(usual, profile=replace(usual.profile, places=places))


def drawn(prior: Prior, space: DesignSpace = VALVE_SPACE) -> Singles:
    return Case(prior, space).drawn(MANY, 1).values


def test_windows_are_in_their_places_as_often_as_stated_and_have_the_width_of_the_place() -> None:
    values = drawn(prior_with(HERE, THERE))[0]
    for place in (HERE, THERE):
        inside = np.abs(values[:, 0] - place.start_ms.median) < 20
        inside &= np.abs(values[:, 1] - np.log(place.width_ms.median)) < 0.4
        assert place.share < inside.mean() < place.share + 0.04


def test_start_and_width_have_a_density_that_is_the_law_of_the_draws() -> None:
    # The mean over draws of any density over that of the law is 1.
    prior = prior_with(HERE, THERE)
    values = drawn(prior)
    start, width = values[..., 0], values[..., 1]
    other = norm.logpdf(start, 150.0, 4.0) + norm.logpdf(width, 4.1, 0.08)
    ratio = np.exp(other - prior.log_densities(values, VALVE_SPACE)["place"])
    assert ratio.mean().item() == pytest.approx(1.0, abs=0.03)


def test_each_place_has_its_part_of_the_density() -> None:
    prior = prior_with(HERE, THERE)
    parts = softmax(prior.log_places(drawn(prior), VALVE_SPACE), axis=-1)[0]
    assert parts.mean(0).tolist() == pytest.approx([0.3, 0.5, 0.2], abs=0.02)


def test_without_places_and_early_windows_start_and_width_do_not_depend_on_each_other() -> None:
    prior = Prior(ProfilePrior(early=()))
    values = drawn(prior)
    start = prior.profile.start.log_density(values[..., 0], VALVE_SPACE)
    width = prior.mixtures["width"].log_density(values[..., 1:2])
    np.testing.assert_allclose(prior.log_densities(values, VALVE_SPACE)["place"], start + width, rtol=1e-6)


def test_windows_that_start_before_the_hit_are_wide_and_others_start_when_they_like() -> None:
    prior = Prior(ProfilePrior(start=StartPrior(p_anywhere=0.0)))
    start, width = drawn(prior, IMPACT_SPACE)[0, :, :2].T
    early, wide = (start > -40) & (start < 0), np.exp(width) > 160
    assert (early & wide).mean() > 0.08
    assert (wide & early).sum() / wide.sum() > 0.25
    assert (~wide & early).sum() / (~wide).sum() < 0.1


@pytest.mark.parametrize("hit_delay_ms", [None, (180.0, 5.0)])
def test_early_windows_have_a_density_that_is_the_law_of_the_draws(hit_delay_ms: tuple[float, float] | None) -> None:
    # The mean over draws of any density over that of the law is 1.
    prior = Prior(ProfilePrior(start=StartPrior(hit_delay_ms=hit_delay_ms)))
    values = drawn(prior)
    for start_ms, log_width in ((165.0, 5.3), (230.0, 4.7)):
        other = norm.logpdf(values[..., 0], start_ms, 10.0) + norm.logpdf(values[..., 1], log_width, 0.3)
        ratio = np.exp(other - prior.log_densities(values, VALVE_SPACE)["place"])
        assert ratio.mean().item() == pytest.approx(1.0, abs=0.06)


def test_early_windows_leave_something_to_others() -> None:
    early = ProfilePrior().early[0]
    with pytest.raises(InvalidValueError, match="less than 1"):
        ProfilePrior(early=(replace(early, share=1.0),))


def test_something_is_left_to_anywhere_else() -> None:
    with pytest.raises(InvalidValueError, match="less than 1"):
        prior_with(HERE, replace(THERE, share=0.5))


def test_places_count_from_one_event_and_that_of_the_space() -> None:
    with pytest.raises(InvalidValueError, match="one event"):
        prior_with(HERE, replace(THERE, reference="impact"))
    of_the_impact = replace(HERE, reference="impact", hit_delay_ms=None)
    for place, other, space in ((HERE, "impact", IMPACT_SPACE), (of_the_impact, "valve command", VALVE_SPACE)):
        reference = place.reference
        with pytest.raises(InvalidValueError, match=rf'reference = "{reference}".*from the {other}'):
            ParticleModel(prior_with(place), particles=10).begin(space, 0)


@pytest.mark.parametrize(
    ("learnt_with", "delay_ms", "is_of_it"),
    [
        ({}, 200.0, True),  # nobody stated it
        ({"hit_delay_ms": (180.0, 5.0)}, None, True),
        ({"hit_delay_ms": (180.0, 5.0)}, 190.0, True),
        ({"hit_delay_ms": (180.0, 5.0)}, 190.1, False),
        ({"hit_delay_ms": (180.0, 5.0), "reference": "impact"}, 200.0, True),
    ],
)
def test_a_place_from_the_valve_is_of_rigs_whose_taps_are_as_late(
    learnt_with: dict[str, Any], delay_ms: float | None, *, is_of_it: bool
) -> None:
    assert replace(HERE, **learnt_with).is_of_rig(None if delay_ms is None else (delay_ms, 5.0)) is is_of_it


@pytest.mark.parametrize("wrong", [{"share": 1.5}, {"width_ms": (0.0, 0.1)}, {"reference": "tms"}])
def test_an_impossible_place_is_refused(wrong: Any) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        replace(HERE, **wrong)


def test_a_known_muscle_keeps_what_was_learnt_of_it() -> None:
    learnt = replace(Prior().muscles[0], name="as in the lab", share=0.25)
    prior = replace(Prior(), muscles=beside(Prior().muscles, [learnt, learnt]), muscle="forearm")
    assert [muscle.name for muscle in prior.possible_muscles] == [
        "forearm",
        "other muscle",
        "as in the lab",
        "as in the lab",
    ]
    assert len(set(prior.hypotheses)) == len(prior.hypotheses) == 7
    latents = Case(prior, VALVE_SPACE).drawn(500, 1)
    assert int(prior.hypothesis(latents).max()) < 7
