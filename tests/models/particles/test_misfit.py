import math

import numpy as np
import pytest

import isiw
from isiw.change import Misfit
from isiw.design import VALVE_SPACE
from isiw.estimate import WindowEstimate
from isiw.models.particles import ParticleModel
from isiw.models.particles.misfit import Bets
from isiw.models.protocol import Observation
from isiw.models.shared.history import observed
from isiw.trials import Trial
from isiw.types import FloatArray
from known import known


def bets_after(below: FloatArray) -> Bets:
    """The bets of people after amplitudes of these predictive probabilities, (n, b)."""
    bets = Bets()
    for one in below:
        bets = bets.after(np.stack((one, one), axis=-1))
    return bets


def test_where_the_law_is_right_a_bet_against_it_is_expected_to_win_nothing() -> None:
    bets = bets_after(np.random.default_rng(0).random((60, 2000)))
    worth = np.exp([bets.most[person] for person in range(2000)])
    for least in (10, 20, 100):
        assert (worth >= least).mean() < 1 / least
    assert np.exp(bets_after(np.random.default_rng(1).random((3, 100_000))).log_won[-1]).mean(0) == pytest.approx(
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
    bets = Bets().after(np.stack((ends[:-1], ends[1:]), axis=-1))
    np.testing.assert_allclose(np.diff(ends) @ np.exp(bets.log_won[-1]), 1.0, atol=1e-9)


def test_larger_amplitudes_are_less_probably_exceeded() -> None:
    posterior = ParticleModel(particles=1000).begin(isiw.VALVE_SPACE, 0)
    below = []
    for mep_mv in (1e-4, 0.01, 0.05, 10.0):
        trial = observed(Observation.of(np.array([250.0]), np.array([mep_mv])), 0.005, 0.02, 0)
        crowd, dice = posterior.swarm.crowd.copied(), np.zeros(1, dtype=np.uint64)
        low, high, weight = posterior.law.learn(trial.columns, 0.0, (0, 0), dice, crowd)[0, 6:]
        assert low == high
        below.append(high / weight)
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


def over_a_curve(least_mv: float, lowest_pct_rmt: float = 90.0) -> tuple[tuple[float, float], ...]:
    """25 pulses alone at five intensities, with sizes that grow with the intensity."""
    over_pct = lowest_pct_rmt + np.arange(25) % 5 * 10.0
    sizes_mv = least_mv * np.exp((over_pct - 90.0) / 20.0 + 0.3 * np.random.default_rng(3).standard_normal(25))
    return tuple(zip(over_pct.tolist(), sizes_mv.tolist(), strict=True))


SILENT_MV = 0.01 * np.exp(0.2 * np.random.default_rng(4).standard_normal(10))


@pytest.mark.parametrize(("least_mv", "contradicts"), [(0.03, True), (0.01, False), (0.003, False)])
def test_pulses_alone_of_three_times_the_level_are_said_not_to_fit_and_others_are_not(
    least_mv: float, *, contradicts: bool
) -> None:
    misfit = known(examined(SILENT_MV, over_a_curve(least_mv)).misfit)
    assert misfit.of_curve == contradicts
    assert math.isfinite(known(misfit.curve))


def test_pulses_that_are_all_stronger_than_the_pairs_say_nothing_of_the_level() -> None:
    assert known(examined(SILENT_MV, over_a_curve(0.03, lowest_pct_rmt=95.0)).misfit).curve is None


def test_a_few_pairs_say_nothing_of_the_level() -> None:
    assert known(examined(SILENT_MV[:7], over_a_curve(0.03)).misfit).curve is None


def test_large_pairs_are_an_effect_of_the_tap_and_no_other_level() -> None:
    assert known(known(examined(30.0 * SILENT_MV, over_a_curve(0.01)).misfit).curve) < 1


def test_levels_are_compared_person_by_person_and_pulses_of_another_one_left_out() -> None:
    model = ParticleModel(particles=50)
    posterior = model.begin(VALVE_SPACE, 0, people=2)
    for _ in range(5):
        alone = Observation.of([None, None], [0.03, 0.01], shift_pct_rmt=[0.0, 0.0])
        posterior = model.update(posterior, alone)
    for mep_mv in SILENT_MV:
        posterior = model.update(posterior, Observation.of([60.0, 60.0], [mep_mv, mep_mv]))
    assert [known(posterior.estimate(person).misfit).of_curve for person in (0, 1)] == [True, False]
    weights = np.exp(posterior.swarm.log_weights)
    assert weights.sum(1) == pytest.approx(1.0)
    contradicted, other = weights[:, posterior.swarm.of_given].sum(1)
    assert 0 < contradicted < 1e-20
    assert other > 0.5


def test_nothing_is_bet_on_pulses_given_alone_which_count_as_parts_of_a_trial() -> None:
    misfit = known(examined(SILENT_MV[:1], tuple((pct_rmt, 0.02) for pct_rmt, _ in 3 * over_a_curve(0.01))).misfit)
    assert misfit.law < 2


def test_what_is_doubted_is_a_matter_of_the_figures_alone() -> None:
    assert Misfit(100.0).of_law
    assert not Misfit(99.0, 49.0).of_law
    assert not Misfit(99.0, 49.0).of_curve
    assert Misfit(1.0, 50.0).of_curve
