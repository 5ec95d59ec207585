from __future__ import annotations

import math
from dataclasses import astuple, fields, replace
from typing import Any

import pytest
import torch

from isiw.design import IMPACT_SPACE, VALVE_SPACE
from isiw.errors import InvalidValueError
from isiw.models.particles.changes import ChangeKind, ChangePrior
from isiw.models.particles.latents import BLOCKS, LATENTS, latents_of, used_by
from isiw.models.particles.laws import (
    FOREARM,
    HAND,
    Floor,
    Gain,
    Intensity,
    Muscle,
    NoiseShares,
    RectifiedPrior,
    SessionPrior,
    SwitchPrior,
)
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import Person, Prior
from isiw.models.particles.profile import ProfilePrior, ShapeShares, Width
from isiw.models.particles.shapes import ShapeKind
from isiw.models.particles.supra.prior import SupraPrior
from isiw.models.shared.scales import Scale
from isiw.models.shared.start import StartPrior
from isiw.priors.population import beside
from isiw.types import Conditioning

MANY = 20_000
ONLY_CURVES = NoiseShares(0.0, 0.0, 1.0, 0.0, 0.0)
ONLY_RECTIFIED = NoiseShares(0.0, 0.0, 0.0, 0.0, 1.0)


def people(prior: Prior) -> Person:
    return prior.person(prior.sample(1, MANY, torch.Generator().manual_seed(1), VALVE_SPACE))


def test_kinds_come_as_often_as_the_prior_says() -> None:
    prior = Prior()
    person = people(prior)
    for kinds, named in ((person.shape.kind, prior.profile.shapes), (person.response.kind, prior.noise)):
        probabilities = astuple(named)
        shares = torch.bincount(kinds[0], minlength=len(probabilities)) / MANY
        assert (shares - torch.tensor(probabilities)).abs().max() < 0.015
    assert person.present.float().mean().item() == pytest.approx(prior.profile.p_window, abs=0.012)


@pytest.mark.parametrize(
    ("part", "wrong"),
    [
        (ProfilePrior, {"p_window": 2.0}),
        (Width, {"width_ms": Scale(float("nan"), 0.5)}),
        (Width, {"share": 1.5}),
        (Gain, {"cv": Scale(0.0, 0.3)}),
        (SwitchPrior, {"reliability": Scale(0.0, -1.0)}),
        (RectifiedPrior, {"onset": Scale(-0.1, 0.5)}),
        (RectifiedPrior, {"rest_pct": Scale(-6.0, 0.0)}),
        (Floor, {"median_mv": Scale(0.009, 0.0)}),
        (Intensity, {"pct_rmt": Scale(100.0, 0.0)}),
        (Prior, {"intensity_pct_rmt": 0.0}),
        (SessionPrior, {"drift_sd": -0.1}),
        (SessionPrior, {"startup": Scale(0.5, -0.5)}),
        (SwitchPrior, {"reliability": Scale(0.2, 0.7, 0.1)}),  # a mixture has other components instead of tails
    ],
)
def test_an_invalid_part_is_refused(part: type, wrong: dict[str, object]) -> None:
    usual = {Width: (0.5, Scale(100.0, 0.4)), Gain: (0.5, Scale(7.0, 0.6), Scale(0.6, 0.3))}
    usual |= {Intensity: (0.5, Scale(100.0, 5.0))}
    usual |= {Floor: (0.5, Scale(0.009, 0.4), Scale(0.2, 0.4))}
    sound = part(*usual.get(part, ()))
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        replace(sound, **wrong)


@pytest.mark.parametrize(
    "wrong", [{"boost_pct": Scale(3.0, 0.0)}, {"rest_pct": Scale(-4.5, -0.4)}, {"ratio": Scale(-1.0, 0.9)}]
)
def test_an_invalid_muscle_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        replace(HAND, **wrong)


@pytest.mark.parametrize(
    ("part", "name"),
    [
        (Prior, "gains"),
        (Prior, "muscles"),
        (Prior, "floors"),
        (Prior, "intensities"),
        (SwitchPrior, "sizes"),
        (ProfilePrior, "widths"),
        (SupraPrior, "curves"),
        (SupraPrior, "floors"),
    ],
)
def test_the_shares_of_several_laws_sum_to_one(part: Any, name: str) -> None:
    laws = getattr(part(), name)
    for wrong in ((), (replace(laws[0], share=0.0),), (*laws, laws[0])):
        with pytest.raises(InvalidValueError, match=f"{name} must sum to 1"):
            part(**{name: wrong})


@pytest.mark.parametrize("shares", [ShapeShares, NoiseShares])
def test_shares_sum_to_one(shares: type) -> None:
    first = fields(shares)[0].name
    with pytest.raises(InvalidValueError, match="sum to 1"):
        shares(**{first: 1.0})
    with pytest.raises(InvalidValueError, match=first):
        shares(**{first: -0.2})


def test_every_kind_has_its_share_in_the_order_of_the_kinds() -> None:
    assert [f.name for f in fields(ShapeShares)] == [kind.name.lower() for kind in ShapeKind]
    assert [f.name for f in fields(NoiseShares)] == [kind.name.lower() for kind in NoiseKind]


def test_blocks_of_latents_are_named() -> None:
    chosen = latents_of("start", "form", device=torch.device("cpu"))
    names = [name for name, inside in zip(LATENTS, chosen.tolist(), strict=True) if inside]
    assert names == ["start_ms", "form"]


def test_without_a_window_or_a_curve_their_latents_mean_nothing() -> None:
    noise = torch.tensor([[NoiseKind.CONSTANT_CV, NoiseKind.RECRUITMENT]])
    used = used_by(noise, torch.tensor([[False, True]]))[0]
    plain, curved = ({name for name, inside in zip(LATENTS, each.tolist(), strict=True) if inside} for each in used)
    assert plain == {*BLOCKS["floor"], *BLOCKS["session"], *BLOCKS["gain"]}
    assert curved == {"start_ms", "log_width_ms", "form", *BLOCKS["floor"], *BLOCKS["session"], *BLOCKS["recruitment"]}


@pytest.mark.parametrize("muscle", [FOREARM, HAND])
def test_a_muscles_curves_are_as_it_says(muscle: Muscle) -> None:
    # Half of a normal variable lies within 0.674 SDs of its median.
    one = (replace(muscle, share=1.0),)
    response = people(Prior(noise=ONLY_CURVES, muscles=one, intensity_pct_rmt=90.0)).response
    slope = muscle.slope_per_pct.median
    for values, scale in ((response.log_ratio.exp(), muscle.ratio), (response.spread, muscle.input_sd)):
        assert values.median().item() == pytest.approx(scale.median, rel=0.05)
        far = (values.log() - values.log().median()).abs().median().item()
        assert far == pytest.approx(0.674 * scale.sd, rel=0.05)
    assert response.rest.median().item() == pytest.approx(slope * muscle.rest_pct.median, rel=0.05)
    assert response.boost.median().item() == pytest.approx(slope * muscle.boost_pct.median, rel=0.05)


def test_curves_that_start_at_a_threshold_are_as_their_law_says() -> None:
    prior = Prior(noise=ONLY_RECTIFIED, intensity_pct_rmt=90.0)
    law, response = prior.rectified, people(prior).response
    slope = law.slope_per_pct.median
    assert response.log_ratio.exp().median().item() == pytest.approx(law.ratio.median, rel=0.06)
    assert response.onset.median().item() == pytest.approx(law.onset.median, rel=0.05)
    assert 0.0 < response.onset.min().item() < response.onset.max().item() <= 0.9
    assert response.boost.median().item() == pytest.approx(slope * law.boost_pct.median, rel=0.05)
    latents = prior.sample(1, MANY, torch.Generator().manual_seed(1), VALVE_SPACE)
    shift_pct_rmt = prior.shift_pct_rmt(latents)[latents.present]
    assert shift_pct_rmt.median().item() == pytest.approx(law.boost_pct.median, rel=0.05)
    below_threshold_pct = (torch.logit(response.onset) - response.rest) / response.slope
    assert below_threshold_pct.median().item() == pytest.approx(-law.rest_pct.median, rel=0.05)


def test_no_other_curve_has_a_threshold() -> None:
    response = people(Prior()).response
    assert bool(((response.onset > 0) == (response.kind == NoiseKind.RECTIFIED)).all())


def test_hands_reach_from_small_meps_to_large_ones() -> None:
    # A of 0.2 and 3 mV over a floor of 0.009 mV.
    response = people(Prior(noise=ONLY_CURVES, muscles=(replace(HAND, share=1.0),), muscle="hand")).response
    largest = response.log_ratio.exp()
    for rare in (largest < 0.2 / 0.009, largest > 3.0 / 0.009):
        assert 0.01 < rare.float().mean().item() < 0.25


@pytest.mark.parametrize(("muscle", "x50_pct_rmt"), [(FOREARM, 105.0), (HAND, 117.0)])
def test_an_intensity_that_is_stated_says_where_on_its_curve_a_muscle_rests(muscle: Muscle, x50_pct_rmt: float) -> None:
    one, slope = (replace(muscle, share=1.0),), muscle.slope_per_pct.median
    for stated_pct_rmt in (90.0, 110.0):
        prior = Prior(noise=ONLY_CURVES, muscles=one, intensity_pct_rmt=stated_pct_rmt)
        rest_pct = people(prior).response.rest / slope
        assert rest_pct.median().item() == pytest.approx(stated_pct_rmt - x50_pct_rmt, abs=0.5)
        assert rest_pct.std().item() < 5.0


def test_any_intensity_from_80_to_130_is_possible_where_none_is_stated() -> None:
    forearm = (replace(FOREARM, share=1.0),)
    intensity_pct = 105.0 + people(Prior(noise=ONLY_CURVES, muscles=forearm)).response.rest / 0.30
    for beyond, least in ((intensity_pct < 85.0, 0.008), (intensity_pct > 100.0, 0.15), (intensity_pct > 125.0, 0.01)):
        assert beyond.float().mean().item() > least
    assert ((intensity_pct - 90.0).abs() < 4.0).float().mean().item() > 0.7


def test_a_curve_that_was_learnt_stays_where_it_is_whatever_the_intensity() -> None:
    learnt = replace(FOREARM, name="as in the lab", at_pct_rmt=None, share=1.0)
    for stated_pct_rmt in (None, 120.0):
        prior = Prior(noise=ONLY_CURVES, muscles=(learnt,), intensity_pct_rmt=stated_pct_rmt)
        assert people(prior).response.rest.median().item() == pytest.approx(0.30 * -15.0, rel=0.05)


def test_narrow_windows_are_possible_unless_a_tap_is_stated() -> None:
    def narrow(conditioning: Conditioning | None) -> float:
        person = people(Prior(ProfilePrior(conditioning=conditioning)))
        return (person.shape.width_ms < 40.0).float().mean().item()

    assert narrow("tap") < 0.03
    assert 0.06 < narrow(None) < 0.18 < narrow("electrical")


def test_a_known_muscle_leaves_only_itself_and_what_has_no_name() -> None:
    names = Prior(muscle="hand").hypotheses
    assert "recruitment curve, hand" in names
    assert "recruitment curve, other muscle" in names
    assert "recruitment curve, forearm" not in names
    with pytest.raises(InvalidValueError, match="forearm"):
        Prior(muscle="foot")


def test_the_density_is_the_law_that_samples_are_drawn_from() -> None:
    # Importance weights between the prior and one of other widths average to 1, and so would not with another density.
    # Both densities leave out the same constant.
    here, there = Prior(), Prior(ProfilePrior(widths=(Width(1.0, Scale(110.0, 0.5)),)))
    latents = here.sample(1, MANY, torch.Generator().manual_seed(2), VALVE_SPACE)
    ratio = (there.log_density(latents.values, VALVE_SPACE) - here.log_density(latents.values, VALVE_SPACE)).exp()
    assert ratio.mean().item() == pytest.approx(1.0, abs=0.02)
    assert ratio.std().item() > 0.1


def test_a_person_unlike_most_is_told_by_the_part_that_is_unusual() -> None:
    prior = Prior(ProfilePrior(start=StartPrior(hit_delay_ms=(180.0, 6.2))))
    latents = prior.sample(1, 500, torch.Generator().manual_seed(0), VALVE_SPACE)
    usual = latents.values.clone()
    usual[..., LATENTS.index("start_ms")] = 240.0
    usual[..., LATENTS.index("log_width_ms")] = math.log(90.0)
    usual[..., LATENTS.index("log_floor_mv")] = math.log(0.009)
    usual[..., LATENTS.index("log_floor_sd")] = math.log(0.22)
    assert max(prior.unusual(latents._replace(values=usual), VALVE_SPACE).values()) < 0.4
    for name, latent, value in (
        ("the start of the window", "start_ms", 400.0),
        ("the width of the window", "log_width_ms", math.log(400.0)),
        ("the EMG floor", "log_floor_mv", math.log(0.2)),
    ):
        changed = usual.clone()
        changed[..., LATENTS.index(latent)] = value
        shares = prior.unusual(latents._replace(values=changed), VALVE_SPACE)
        assert shares.pop(name) > 0.95
        assert max(shares.values()) < 0.4
    nobody = latents.with_kind("present", torch.zeros_like(latents.present))
    assert list(prior.unusual(nobody, VALVE_SPACE)) == ["the EMG floor"]


def test_whoever_is_as_in_the_lab_is_not_unlike_most() -> None:
    lab = Floor(0.8, Scale(0.05, 0.1), Scale(0.22, 0.3))
    prior = Prior(floors=beside(Prior().floors, [lab]))
    latents = prior.sample(1, 500, torch.Generator().manual_seed(0), VALVE_SPACE)
    values = latents.values.clone()
    values[..., LATENTS.index("log_floor_mv")] = math.log(0.05)
    values[..., LATENTS.index("log_floor_sd")] = math.log(0.22)
    assert prior.unusual(latents._replace(values=values), VALVE_SPACE)["the EMG floor"] < 0.1


def test_a_usual_start_is_usual_with_whatever_rig_where_none_is_stated() -> None:
    prior = Prior()
    latents = prior.sample(1, 500, torch.Generator().manual_seed(0), VALVE_SPACE)
    values = latents.values.clone()
    values[..., LATENTS.index("start_ms")] = 100.0  # too early for the robot
    assert prior.unusual(latents._replace(values=values), VALVE_SPACE)["the start of the window"] < 0.5


@pytest.mark.parametrize("hit_delay_ms", [None, (180.0, 6.2)])
def test_as_usual_unusual_windows_keep_a_part_of_their_probability(hit_delay_ms: Any) -> None:
    profile = ProfilePrior(start=StartPrior(hit_delay_ms=hit_delay_ms))
    usual = profile.as_usual(1 / 3)
    assert [span.share for span in usual.start.spans] == pytest.approx([1 - 0.365 / 3, 0.365 / 3])
    assert [width.share for width in usual.widths] == pytest.approx([1 - 0.345 / 3, 0.23 / 3, 0.115 / 3])
    assert [law.share for law in usual.early] == pytest.approx([0.13 / 3])
    assert usual.start.p_anywhere == pytest.approx(0.04 / 3)
    assert (usual.p_window, usual.start.hit_delay_ms) == (profile.p_window, hit_delay_ms)
    assert profile.as_usual(1.0) == profile


def test_as_usual_unusual_intensities_keep_a_part_of_their_probability_and_curves_tell_by_how_much() -> None:
    prior = Prior(session=SessionPrior(far_drift_share=0.0), changes=ChangePrior(0.0, 0.0, 0.0, 0.0))
    usual = prior.as_usual(1 / 3)
    assert [each.share for each in usual.intensities] == pytest.approx([1 - 0.25 / 3, 0.25 / 3])
    latents = prior.sample(1, MANY, torch.Generator().manual_seed(1), VALVE_SPACE)
    ratio = usual.log_beside(latents) - prior.log_beside(latents)
    rest, curved = latents.values[..., LATENTS.index("rest")], latents.noise == NoiseKind.RECRUITMENT
    assert bool((ratio[~curved & (latents.noise != NoiseKind.RECTIFIED)] == 0).all())
    assert ratio[curved & (rest > 5)].mean().item() == pytest.approx(math.log(1 / 3), abs=0.1)
    assert ratio.exp().mean().item() == pytest.approx(1.0, abs=0.01)
    stated = replace(prior, intensity_pct_rmt=110.0)
    assert bool((stated.as_usual(1 / 3).log_beside(latents) == stated.log_beside(latents)).all())


def test_as_usual_changes_and_far_drifts_keep_a_part_of_their_probability() -> None:
    prior = Prior(intensity_pct_rmt=90.0)
    usual = prior.as_usual(0.2)
    latents = prior.sample(1, MANY, torch.Generator().manual_seed(1), VALVE_SPACE)
    ratio, drift = usual.log_beside(latents) - prior.log_beside(latents), latents.values[..., LATENTS.index("drift")]
    changed, far = latents.change != ChangeKind.NONE, drift.abs() > 1.5
    assert ratio[changed & (drift.abs() < 0.5)].mean().item() == pytest.approx(math.log(0.2), abs=0.15)
    assert ratio[~changed & far].mean().item() == pytest.approx(math.log(0.2 * 0.948 / 0.74), abs=0.05)
    assert ratio.exp().mean().item() == pytest.approx(1.0, abs=0.02)


def test_a_prior_without_steps_has_a_density() -> None:
    prior = Prior(changes=ChangePrior(0.0, 0.0, 0.0, 0.0))
    latents = prior.sample(1, 100, torch.Generator().manual_seed(1), VALVE_SPACE)
    assert bool(prior.log_density(latents.values, VALVE_SPACE).isfinite().all())


def test_after_an_electrical_pulse_windows_are_believed_narrow_and_early() -> None:
    generator = torch.Generator().manual_seed(1)
    prior = Prior(ProfilePrior(conditioning="electrical"))
    shape = prior.person(prior.sample(1, MANY, generator, IMPACT_SPACE)).shape
    usual = (shape.start_ms >= 0) & (shape.start_ms <= 60)
    assert 0.65 < usual.float().mean() < 0.85
    assert 15 < shape.width_ms.median() < 35
    assert (shape.width_ms < 35).float().mean() > 0.65


def test_starts_and_widths_of_ones_own_are_kept_whatever_comes_first() -> None:
    own = (Width(1.0, Scale(50.0, 0.3)),)
    profile = ProfilePrior(widths=own)
    assert replace(profile, conditioning="electrical").widths == own
    assert replace(ProfilePrior(conditioning="electrical"), conditioning=None) == ProfilePrior()
    delayed = ProfilePrior(start=StartPrior(hit_delay_ms=(150.0, 5.0)), conditioning="electrical").start
    assert delayed == replace(ProfilePrior(conditioning="electrical").start, hit_delay_ms=(150.0, 5.0))


def test_a_stimulus_that_is_neither_tap_nor_pulse_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="conditioning"):
        ProfilePrior(conditioning="puff")  # type: ignore[arg-type] # is refused
