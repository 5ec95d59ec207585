from __future__ import annotations

import math
from dataclasses import astuple, fields, replace
from typing import Any

import numpy as np
import pytest
from hatch_build import SOURCES
from scipy.special import logit
from scipy.stats import kstest

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.particles.changes import ChangeKind, ChangePrior
from isiw.models.particles.compiled import Crowd
from isiw.models.particles.jumps import law_of
from isiw.models.particles.latents import BLOCKS, LATENTS, Latents, latents_of, used_by
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
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior, ShapeShares, Width
from isiw.models.particles.records import BOOST, LOG_RATIO, NOISE, ONSET, REST, SLOPE, SPREAD, START, WIDTH
from isiw.models.particles.supra.prior import LATENTS as SUPRA_LATENTS
from isiw.models.particles.supra.prior import SupraPrior
from isiw.models.shared.scales import Scale
from isiw.models.shared.start import StartPrior
from isiw.priors.population import beside
from isiw.types import Conditioning, FloatArray
from native.drawn import Case

MANY = 20_000
ONLY_CURVES = NoiseShares(0.0, 0.0, 1.0, 0.0, 0.0)
ONLY_RECTIFIED = NoiseShares(0.0, 0.0, 0.0, 0.0, 1.0)


def drawn(prior: Prior, size: int = MANY, space: DesignSpace = VALVE_SPACE, seed: int = 1) -> Latents:
    return Case(prior, space).drawn(size, seed)


def people(prior: Prior, space: DesignSpace = VALVE_SPACE) -> FloatArray:
    """Fields of people in general, by their number first, (fields, p)."""
    case = Case(prior, space)
    fields: FloatArray = case.fields(case.drawn(MANY, 1))[0].T.astype(float)
    return fields


def test_kinds_come_as_often_as_the_prior_says() -> None:
    prior = Prior()
    latents = drawn(prior)
    for kinds, probabilities in (
        (latents.shape, astuple(prior.profile.shapes)),
        (latents.noise, astuple(prior.noise)),
        (latents.change, prior.changes.shares),
    ):
        shares = np.bincount(kinds[0], minlength=len(probabilities)) / MANY
        assert np.abs(shares - probabilities).max() < 0.015
    assert latents.present.mean() == pytest.approx(prior.profile.p_window, abs=0.012)
    assert not latents.depressed.any()


def test_latents_have_the_means_and_sds_of_their_laws() -> None:
    # Four standard errors; the SD of a mixture is estimated by up to twice the error of a normal law's.
    prior = Prior(ProfilePrior(early=()))
    values = drawn(prior, 50_000).values[0].astype(float)
    for block, mixture in prior.mixtures.items():
        own = values[:, latents_of(block)]
        means = mixture.shares @ mixture.means
        sds = np.sqrt(mixture.shares @ (mixture.sds**2 + mixture.means**2) - means**2)
        assert (np.abs(own.mean(0) - means) < 4 * sds / math.sqrt(50_000)).all(), block
        np.testing.assert_allclose(own.std(0), sds, rtol=0.04, err_msg=block)
    assert np.corrcoef(values.T)[~np.eye(len(LATENTS), dtype=bool)].max() < 0.5


@pytest.mark.parametrize("hit_delay_ms", [None, (180.0, 6.2)])
def test_starts_have_the_density_of_their_law(hit_delay_ms: Any) -> None:
    prior = Prior(ProfilePrior(start=StartPrior(hit_delay_ms=hit_delay_ms), early=()))
    start_ms = drawn(prior, 50_000).of("start_ms")[0]
    knots = prior.profile.start.knots(VALVE_SPACE)
    assert kstest(start_ms, lambda x: np.interp(x, knots.start_ms, knots.below)).statistic < 1.95 / math.sqrt(50_000)


def test_above_the_threshold_segments_come_as_often_as_stated_and_apart() -> None:
    prior = SupraPrior()
    latents = Case(prior, IMPACT_SPACE).drawn(MANY, 1)
    assert latents.present.mean() == pytest.approx(prior.enhanced.probability, abs=0.01)
    assert latents.depressed.mean() == pytest.approx(prior.depressed.probability, abs=0.01)
    assert (latents.noise == NoiseKind.RECRUITMENT).all()
    z = dict(zip(SUPRA_LATENTS, latents.values[0].T, strict=True))
    for name, law in (("log_shift", prior.enhanced.shift_pct), ("depressed_log_shift", prior.depressed.shift_pct)):
        assert z[name].mean() == pytest.approx(law.log_law[0], abs=0.015)
        assert z[name].std() == pytest.approx(law.log_law[1], rel=0.03)


def test_draws_of_a_seed_are_the_same_again_and_those_of_two_people_differ() -> None:
    first, again = (Case(Prior(), VALVE_SPACE).drawn(50, 3, people=2) for _ in range(2))
    np.testing.assert_array_equal(first.values, again.values)
    assert (first.values[0] != first.values[1]).all()


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
    header = (SOURCES / "people.h").read_text("utf-8").lower()
    noise = [kind.name.lower() for kind in NoiseKind]
    for names in ([f.name for f in fields(ShapeShares)], noise):
        assert f"enum {{ {', '.join(names)} }}" in header
    assert [*(f.name for f in fields(NoiseShares)), "by_levels"] == noise  # which only pulses given alone lead to


def test_blocks_of_latents_are_named() -> None:
    chosen = latents_of("start", "form")
    names = [name for name, inside in zip(LATENTS, chosen.tolist(), strict=True) if inside]
    assert names == ["start_ms", "form"]


def test_without_a_window_or_a_curve_their_latents_mean_nothing() -> None:
    noise = np.array([[NoiseKind.CONSTANT_CV, NoiseKind.RECRUITMENT]])
    used = used_by(noise, np.array([[False, True]]))[0]
    plain, curved = ({name for name, inside in zip(LATENTS, each.tolist(), strict=True) if inside} for each in used)
    assert plain == {*BLOCKS["floor"], *BLOCKS["session"], *BLOCKS["gain"]}
    assert curved == {"start_ms", "log_width_ms", "form", *BLOCKS["floor"], *BLOCKS["session"], *BLOCKS["recruitment"]}


@pytest.mark.parametrize("muscle", [FOREARM, HAND])
def test_a_muscles_curves_are_as_it_says(muscle: Muscle) -> None:
    # Half of a normal variable lies within 0.674 SDs of its median.
    one = (replace(muscle, share=1.0),)
    person = people(Prior(noise=ONLY_CURVES, muscles=one, intensity_pct_rmt=90.0))
    slope = muscle.slope_per_pct.median
    for values, scale in ((np.exp(person[LOG_RATIO]), muscle.ratio), (person[SPREAD], muscle.input_sd)):
        assert np.median(values) == pytest.approx(scale.median, rel=0.05)
        far = np.median(np.abs(np.log(values) - np.median(np.log(values))))
        assert far == pytest.approx(0.674 * scale.sd, rel=0.05)
    assert np.median(person[REST]) == pytest.approx(slope * muscle.rest_pct.median, rel=0.05)
    assert np.median(person[BOOST]) == pytest.approx(slope * muscle.boost_pct.median, rel=0.05)


def test_curves_that_start_at_a_threshold_are_as_their_law_says() -> None:
    prior = Prior(noise=ONLY_RECTIFIED, intensity_pct_rmt=90.0)
    law, person = prior.rectified, people(prior)
    slope, onset = law.slope_per_pct.median, person[ONSET]
    assert np.median(np.exp(person[LOG_RATIO])) == pytest.approx(law.ratio.median, rel=0.06)
    assert np.median(onset) == pytest.approx(law.onset.median, rel=0.05)
    assert 0.0 < onset.min() < onset.max() <= 0.9 + 1e-6
    assert np.median(person[BOOST]) == pytest.approx(slope * law.boost_pct.median, rel=0.05)
    latents = drawn(prior)
    shift_pct_rmt = prior.shift_pct_rmt(latents)[latents.present]
    assert np.median(shift_pct_rmt) == pytest.approx(law.boost_pct.median, rel=0.05)
    below_threshold_pct = (logit(onset) - person[REST]) / person[SLOPE]
    assert np.median(below_threshold_pct) == pytest.approx(-law.rest_pct.median, rel=0.05)


def test_no_other_curve_has_a_threshold() -> None:
    person = people(Prior())
    assert ((person[ONSET] > 0) == (person[NOISE] == NoiseKind.RECTIFIED)).all()


def test_hands_reach_from_small_meps_to_large_ones() -> None:
    # A of 0.2 and 3 mV over a floor of 0.009 mV.
    largest = np.exp(people(Prior(noise=ONLY_CURVES, muscles=(replace(HAND, share=1.0),), muscle="hand"))[LOG_RATIO])
    for rare in (largest < 0.2 / 0.009, largest > 3.0 / 0.009):
        assert 0.01 < rare.mean() < 0.25


@pytest.mark.parametrize(("muscle", "x50_pct_rmt"), [(FOREARM, 105.0), (HAND, 117.0)])
def test_an_intensity_that_is_stated_says_where_on_its_curve_a_muscle_rests(muscle: Muscle, x50_pct_rmt: float) -> None:
    one, slope = (replace(muscle, share=1.0),), muscle.slope_per_pct.median
    for stated_pct_rmt in (90.0, 110.0):
        prior = Prior(noise=ONLY_CURVES, muscles=one, intensity_pct_rmt=stated_pct_rmt)
        rest_pct = people(prior)[REST] / slope
        assert np.median(rest_pct) == pytest.approx(stated_pct_rmt - x50_pct_rmt, abs=0.5)
        assert rest_pct.std() < 5.0


def test_any_intensity_from_80_to_130_is_possible_where_none_is_stated() -> None:
    forearm = (replace(FOREARM, share=1.0),)
    intensity_pct = 105.0 + people(Prior(noise=ONLY_CURVES, muscles=forearm))[REST] / 0.30
    for beyond, least in ((intensity_pct < 85.0, 0.008), (intensity_pct > 100.0, 0.15), (intensity_pct > 125.0, 0.01)):
        assert beyond.mean() > least
    assert (np.abs(intensity_pct - 90.0) < 4.0).mean() > 0.7


def test_a_curve_that_was_learnt_stays_where_it_is_whatever_the_intensity() -> None:
    learnt = replace(FOREARM, name="as in the lab", at_pct_rmt=None, share=1.0)
    for stated_pct_rmt in (None, 120.0):
        prior = Prior(noise=ONLY_CURVES, muscles=(learnt,), intensity_pct_rmt=stated_pct_rmt)
        assert np.median(people(prior)[REST]) == pytest.approx(0.30 * -15.0, rel=0.05)


def test_narrow_windows_are_possible_unless_a_tap_is_stated() -> None:
    def narrow(conditioning: Conditioning | None) -> float:
        return float((people(Prior(ProfilePrior(conditioning=conditioning)))[WIDTH] < 40.0).mean())

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
    here, there = Prior(), Prior(ProfilePrior(widths=(Width(1.0, Scale(110.0, 0.5)),)))
    values = drawn(here, seed=2).values
    other, own = (prior.log_densities(values, VALVE_SPACE) for prior in (there, here))
    ratio = np.exp(np.sum([other[block] - own[block] for block in own], axis=0))
    assert ratio.mean() == pytest.approx(1.0, abs=0.02)
    assert ratio.std() > 0.1


def test_a_person_unlike_most_is_told_by_the_part_that_is_unusual() -> None:
    prior = Prior(ProfilePrior(start=StartPrior(hit_delay_ms=(180.0, 6.2))))
    latents = drawn(prior, 500, seed=0)
    usual = latents.values.copy()
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
        changed = usual.copy()
        changed[..., LATENTS.index(latent)] = value
        shares = prior.unusual(latents._replace(values=changed), VALVE_SPACE)
        assert shares.pop(name) > 0.95
        assert max(shares.values()) < 0.4
    nobody = latents.with_kind("present", np.zeros_like(latents.noise))
    assert list(prior.unusual(nobody, VALVE_SPACE)) == ["the EMG floor"]


def test_whoever_is_as_in_the_lab_is_not_unlike_most() -> None:
    lab = Floor(0.8, Scale(0.05, 0.1), Scale(0.22, 0.3))
    prior = Prior(floors=beside(Prior().floors, [lab]))
    latents = drawn(prior, 500, seed=0)
    values = latents.values.copy()
    values[..., LATENTS.index("log_floor_mv")] = math.log(0.05)
    values[..., LATENTS.index("log_floor_sd")] = math.log(0.22)
    assert prior.unusual(latents._replace(values=values), VALVE_SPACE)["the EMG floor"] < 0.1


def test_a_usual_start_is_usual_with_whatever_rig_where_none_is_stated() -> None:
    prior = Prior()
    latents = drawn(prior, 500, seed=0)
    values = latents.values.copy()
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
    latents = drawn(prior)
    ratio = beside_ratio(usual, prior, latents)
    rest, curved = latents.of("rest"), latents.noise == NoiseKind.RECRUITMENT
    others = ratio[~curved & (latents.noise != NoiseKind.RECTIFIED)]
    assert np.ptp(others) < 1e-4
    assert others.mean() == pytest.approx(0.0, abs=0.01)  # the mean ratio over draws is 1
    assert ratio[curved & (rest > 5)].mean() == pytest.approx(math.log(1 / 3), abs=0.1)
    stated = replace(prior, intensity_pct_rmt=110.0)
    assert np.abs(beside_ratio(stated.as_usual(1 / 3), stated, latents)).max() < 1e-4


def beside_ratio(usual: Prior, prior: Prior, latents: Latents) -> FloatArray:
    """By how much people without a window are more probable where ISIs are chosen, natural log, (1, p)."""
    nobody, equal = latents.with_kind("present", np.zeros_like(latents.noise)), np.zeros(latents.noise.shape)
    laws = [law_of(each, VALVE_SPACE) for each in (prior, usual)]
    nothing = laws[0].nothing_known(1, latents.noise.shape[-1])
    found = laws[0].usual_weights(laws[1], Crowd(*nobody, equal, equal.astype(np.float32), nothing))
    return found + math.log(MANY)  # they sum to 1


def test_as_usual_changes_and_far_drifts_keep_a_part_of_their_probability() -> None:
    prior = Prior(intensity_pct_rmt=90.0)
    usual = prior.as_usual(0.2)
    latents = drawn(prior)
    ratio, drift = beside_ratio(usual, prior, latents), np.abs(latents.of("drift"))
    changed, far = latents.change != ChangeKind.NONE, drift > 1.5
    assert ratio[changed & (drift < 0.5)].mean() == pytest.approx(math.log(0.2), abs=0.15)
    assert ratio[~changed & far].mean() == pytest.approx(math.log(0.2 * 0.948 / 0.74), abs=0.05)


def test_a_prior_without_steps_has_a_density() -> None:
    prior = Prior(changes=ChangePrior(0.0, 0.0, 0.0, 0.0))
    densities = prior.log_densities(drawn(prior, 100).values, VALVE_SPACE)
    assert all(np.isfinite(each).all() for each in densities.values())


def test_after_an_electrical_pulse_windows_are_believed_narrow_and_early() -> None:
    person = people(Prior(ProfilePrior(conditioning="electrical")), IMPACT_SPACE)
    usual = (person[START] >= 0) & (person[START] <= 60)
    assert 0.65 < usual.mean() < 0.85
    assert 15 < np.median(person[WIDTH]) < 35
    assert (person[WIDTH] < 35).mean() > 0.65


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


def test_a_far_drift_has_its_share_of_the_sessions() -> None:
    assert Prior(session=SessionPrior(far_drift_share=0.2)).mixtures["session"].shares == pytest.approx([0.8, 0.2])
