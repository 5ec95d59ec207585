import math

import numpy as np
import pytest

import isiw
from isiw.change import Misfit
from isiw.design import VALVE_SPACE
from isiw.estimate import WindowEstimate
from isiw.models.particles import ParticleModel
from isiw.models.particles.laws import NoiseShares
from isiw.models.particles.misfit import Bets, probability_below
from isiw.models.particles.prior import Prior
from isiw.models.protocol import Observation
from isiw.models.shared.history import observed
from isiw.trials import Trial
from isiw.types import FloatArray
from known import known


def bets_after(below: FloatArray) -> Bets:
    """The bets of people after amplitudes of these predictive probabilities, (n, b)."""
    bets = Bets.none(below.shape[1])
    for one in below:
        bets = bets.after(np.stack((one, one), axis=-1))
    return bets


def test_where_the_law_is_right_a_bet_against_it_is_expected_to_win_nothing() -> None:
    bets = bets_after(np.random.default_rng(0).random((60, 2000)))
    worth = np.exp([bets.most[person] for person in range(2000)])
    for least in (10, 20, 100):
        assert (worth >= least).mean() < 1 / least
    assert np.exp(bets_after(np.random.default_rng(1).random((3, 100_000))).log_won).mean(0) == pytest.approx(
        1, abs=0.05
    )


@pytest.mark.parametrize(
    "change", [lambda u: u**0.5, lambda u: u**2, lambda u: 0.5 + 0.5 * np.cos(np.pi * u), lambda u: 0.3 + 0.4 * u]
)
def test_amplitudes_larger_smaller_more_or_less_spread_out_than_expected_are_noticed(change: object) -> None:
    assert callable(change)
    bets = bets_after(change(np.random.default_rng(2).random((80, 50))))
    assert np.median(np.exp(bets.most)) > 100


def test_an_amplitude_between_two_ends_is_paid_by_the_mean_of_what_lies_between_them() -> None:
    ends = np.array([0.0, 0.2, 0.21, 0.7, 1.0])
    bets = Bets.none(4).after(np.stack((ends[:-1], ends[1:]), axis=-1))
    np.testing.assert_allclose(np.diff(ends) @ np.exp(bets.log_won), 1.0, atol=1e-9)


def test_larger_amplitudes_are_less_probably_exceeded() -> None:
    posterior = ParticleModel(particles=1000).begin(isiw.VALVE_SPACE, 0)
    below = []
    for mep_mv in (1e-4, 0.01, 0.05, 10.0):
        trial = observed(Observation.of(np.array([250.0]), np.array([mep_mv])), 0.005, 0.02, 0)
        low, high = probability_below(trial, posterior.swarm.crowd, posterior.law, np.ones((1, 1000), dtype=bool))[0]
        assert low == high
        below.append(high)
    assert below == sorted(below)
    assert below[0] < 0.01
    assert 0.3 < below[1] < below[2]
    assert below[-1] > 0.99


def examined(amplitudes_mv: FloatArray, pulses: tuple[tuple[float, float], ...] = ()) -> WindowEstimate:
    """The estimate after pulses alone and then pairs at ISIs all over the range."""
    strategy = isiw.make_strategy(seed=0, hit_delay_ms=(180.0, 6.0), particles=300)
    for intensity_pct_rmt, mep_mv in pulses:
        strategy.learn(Trial.of(None, mep_mv, intensity_pct_rmt=intensity_pct_rmt))
    for pair, mep_mv in enumerate(amplitudes_mv.tolist()):
        strategy.learn(Trial.of(float(61 * pair % 501), mep_mv))
    return strategy.estimate()


def test_amplitudes_that_no_person_has_make_the_model_doubt_its_law() -> None:
    estimate = examined(0.008 * 1.2 ** np.arange(24.0))
    misfit = known(estimate.misfit)
    assert misfit.of_law
    assert not misfit.of_curve
    assert misfit.curve is None


def test_pulses_alone_that_the_pairs_contradict_are_said_not_to_fit_and_others_are_not() -> None:
    rng = np.random.default_rng(3)
    over_pct = np.linspace(90.0, 130.0, 20)
    noise, silent_mv = np.exp(0.3 * rng.standard_normal(20)), 0.01 * np.exp(0.2 * rng.standard_normal(10))
    for least_mv, contradicts in ((0.3, True), (0.012, False)):
        growing_mv = least_mv * np.exp((over_pct - 90.0) / 20.0) * noise
        misfit = known(examined(silent_mv, tuple(zip(over_pct.tolist(), growing_mv.tolist(), strict=True))).misfit)
        assert misfit.of_curve == contradicts
        assert math.isfinite(known(misfit.curve))


@pytest.mark.parametrize("without", [0.0, 1e-6])
def test_a_prior_of_hardly_anything_but_curves_does_not_speak_against_one(without: float) -> None:
    noise = NoiseShares(constant_cv=without, missing=0, recruitment=1 - without, all_or_none=0, rectified=0)
    model = ParticleModel(Prior(noise=noise), particles=100)
    posterior = model.begin(VALVE_SPACE, 0)
    for pct_rmt, mep_mv in ((100.0, 0.05), (120.0, 0.4)):
        told = Observation.of([None], [mep_mv], shift_pct_rmt=[pct_rmt - model.pairs_pct_rmt])
        posterior = model.update(posterior, told)
    posterior = model.update(posterior, Observation.of([60.0], [0.05]))
    assert not known(posterior.estimate().misfit).of_curve


def test_what_is_doubted_is_a_matter_of_the_figures_alone() -> None:
    assert Misfit(100.0).of_law
    assert not Misfit(99.0, 49.0).of_law
    assert not Misfit(99.0, 49.0).of_curve
    assert Misfit(1.0, 50.0).of_curve
