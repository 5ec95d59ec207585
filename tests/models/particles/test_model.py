import math
from dataclasses import astuple, replace
from typing import Any

import numpy as np
import pytest
from scipy.special import log_softmax, logsumexp
from scipy.stats import norm

from isiw.acquisition.information import MutualInformation
from isiw.design import VALVE_SPACE
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.metrics import covers
from isiw.models.particles.latents import LATENTS
from isiw.models.particles.laws import FOREARM, NoiseShares
from isiw.models.particles.model import ParticleModel, ParticlePosterior
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.predictions import PersonSample, drawn_mep_mv
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.models.particles.records import LOG_FLOOR
from isiw.models.particles.swarm import Moving
from isiw.models.protocol import (
    Observation,
    Posterior,
    PredictsOutcomes,
    ResponseModel,
    SamplesWindows,
    SimulatesPeople,
)
from isiw.models.shared.draws import systematic
from isiw.models.shared.history import History, neutral
from isiw.models.windows import grid_of
from isiw.native.engine import log_likelihoods
from isiw.subjects.cohorts import cohort
from isiw.subjects.subject import SimulatedSubject
from isiw.types import FloatArray
from isiw.window import Window
from known import known
from native.drawn import Case, seeds, sweeps

GRID = np.arange(0.0, 501.0, 5.0)


def observation(isi_ms: list[float], mep_mv: list[float], response: list[float] | None = None) -> Observation:
    unknown = [math.nan] * len(isi_ms)
    columns = (isi_ms, mep_mv, [0.0] * len(isi_ms), response or unknown)
    return Observation(*(np.array(column, dtype=np.float32) for column in columns))


def after(model: ParticleModel, trials: list[tuple[float, float]], seed: int = 1) -> ParticlePosterior:
    posterior = model.begin(VALVE_SPACE, seed)
    for isi_ms, mep_mv in trials:
        posterior = model.update(posterior, observation([isi_ms], [mep_mv]))
    return posterior


def spread_ms(estimate: WindowEstimate) -> np.ndarray:
    """Posterior SDs of the edges [ms]; one beyond the range is at its end."""
    return np.asarray(np.std(np.clip(known(estimate.edge_samples_ms), 0.0, 500.0), axis=0))


def mean_medians_ms(estimates: list[WindowEstimate]) -> np.ndarray:
    return np.asarray(np.mean([np.median(known(estimate.edge_samples_ms), axis=0) for estimate in estimates], axis=0))


def evenly(subject: SimulatedSubject, n: int, seed: int = 0) -> list[tuple[float, float]]:
    responder = subject.begin(seed)
    order = np.random.default_rng(seed).permutation(np.linspace(120, 460, n).round())
    return [(isi_ms, responder.respond(isi_ms, "valve").mep_mv) for isi_ms in order.tolist()]


def test_model_and_posterior_keep_their_protocols() -> None:
    model = ParticleModel(particles=20)
    posterior = model.begin(VALVE_SPACE, 0)
    assert isinstance(model, ResponseModel)
    assert isinstance(model, SimulatesPeople)
    for protocol in (Posterior, PredictsOutcomes, SamplesWindows):
        assert isinstance(posterior, protocol)


def test_an_update_changes_no_earlier_posterior() -> None:
    model = ParticleModel(particles=200)
    before = model.begin(VALVE_SPACE, 3)
    latents = before.swarm.latents.values.copy()
    model.update(before, observation([250.0], [0.08]))
    assert before.trials == 0
    np.testing.assert_array_equal(before.swarm.latents.values, latents)


def test_the_same_seed_and_trials_give_the_same_posterior() -> None:
    trials = [(250.0, 0.08), (300.0, 0.02), (100.0, 0.009)]
    first, second = (after(ParticleModel(particles=200), trials).estimate() for _ in range(2))
    assert first.probability == second.probability
    np.testing.assert_array_equal(first.edge_samples_ms, second.edge_samples_ms)


def test_people_in_one_batch_do_not_see_each_other() -> None:
    # The first person's particles wear out or not; what the second is told must not change when.
    model = ParticleModel(particles=200)
    calm = wild = model.begin(VALVE_SPACE, 3, people=2)
    for trial, mep_mv in enumerate((0.010, 0.009, 0.011, 0.010)):
        isi_ms = 20.0 + 10.0 * trial
        calm = model.update(calm, observation([isi_ms, isi_ms], [mep_mv, 0.010]))
        wild = model.update(wild, observation([isi_ms, 280.0], [mep_mv, 0.3 * (trial + 1)]))
        np.testing.assert_array_equal(calm.swarm.latents.values[0], wild.swarm.latents.values[0])
        np.testing.assert_array_equal(calm.swarm.log_weights[0], wild.swarm.log_weights[0])
    assert (calm.swarm.latents.values[1] != wild.swarm.latents.values[1]).any()
    assert calm.estimate(0).probability == wild.estimate(0).probability


def test_an_uncertain_isi_is_integrated_out() -> None:
    # The likelihood must be the average over the ISIs that may have come about, here by brute force on 400 quantiles.
    case = Case(Prior(ProfilePrior(p_window=1.0)), VALVE_SPACE)
    fields, isi_ms, isi_sd_ms = case.fields(case.drawn(4000, 4)), 230.0, 3.0

    def of_trial(isi: float, sd: float) -> FloatArray:
        made = neutral(1)[np.newaxis]
        made[..., :4] = isi, sd, math.log(0.05), math.log(0.05)
        return log_likelihoods(fields, made).astype(float)

    got = of_trial(isi_ms, isi_sd_ms)
    quantiles = norm.ppf((np.arange(400) + 0.5) / 400)
    expected = logsumexp([of_trial(isi_ms + isi_sd_ms * q, 0.0) for q in quantiles], axis=0) - math.log(400)
    # Three nodes are exact up to the fifth power of the SD; only the steepest flanks differ.
    assert np.median(np.abs(got - expected)) < 0.005
    assert np.quantile(np.abs(got - expected), 0.99) < 0.1


def test_an_estimate_knows_the_noise_that_its_samples_suppose() -> None:
    # Of two kinds of noise one has wide windows only, so that kind and width must go together in every sample.
    prior = Prior(
        ProfilePrior(p_window=0.9), NoiseShares(0.5, 0.0, 0.5, 0.0, 0.0), muscles=(replace(FOREARM, share=1.0),)
    )
    posterior = ParticleModel(prior).begin(VALVE_SPACE, 3)
    recruits = posterior.swarm.latents.noise == NoiseKind.RECRUITMENT
    width = LATENTS.index("log_width_ms")
    posterior.swarm.latents.values[..., width] = np.where(recruits, math.log(250.0), math.log(35.0))
    weights = np.linspace(-3.0, 3.0, recruits.shape[-1])[np.newaxis]  # every pick is another particle than its own
    crowd = posterior.swarm.crowd._replace(log_weights=log_softmax(weights, axis=-1))
    estimate = replace(posterior, swarm=replace(posterior.swarm, crowd=crowd)).estimate()
    edges_ms = known(estimate.edge_samples_ms)
    kinds = np.array(estimate.hypothesis_names)[known(estimate.hypothesis_samples)]
    assert set(kinds) == {"constant-CV noise", "recruitment curve, forearm"}
    assert {name for name, share in known(estimate.hypotheses).items() if share} == set(kinds)
    inside = np.isfinite(edges_ms).all(1)
    widths_ms = edges_ms[inside, 1] - edges_ms[inside, 0]
    wide = kinds[inside] == "recruitment curve, forearm"
    assert widths_ms[wide].min() > widths_ms[~wide].max()


@pytest.mark.slow
def test_moves_that_learn_nothing_leave_the_prior_as_it_is() -> None:
    # 8,000 particles, 20 sweeps. Quantiles stay within 0.03, 3 standard errors of a share among 2,500 independent
    # particles, and kinds within 0.025 of their probabilities.
    prior = Prior()
    case = Case(prior, VALVE_SPACE)
    reference, latents = case.drawn(100_000, 1).values[0], case.drawn(8000, 2)
    nothing = neutral(3)[np.newaxis]
    nothing[..., 2], nothing[..., 3] = -np.inf, np.inf
    state = *latents, np.zeros((1, 8000), dtype=np.float32), case.law.nothing_known(1, 8000)
    counts = sweeps(case.law, np.array([20]), nothing, seeds(2), state)
    assert 0.05 < counts[0, 1] / counts[0, 0] < 1
    assert counts[0, 3] / counts[0, 2] > 0.8
    for quantile in (0.1, 0.5, 0.9):
        below = (latents.values[0] < np.quantile(reference, quantile, axis=0)).mean(0)
        assert np.abs(below - quantile).max() < 0.03
    assert abs(latents.present.mean() - prior.profile.p_window) < 0.025
    kinds_of = [(latents.shape, astuple(prior.profile.shapes)), (latents.noise, astuple(prior.noise))]
    for kinds, probabilities in (*kinds_of, (latents.change, prior.changes.shares)):
        shares = np.bincount(kinds[0], minlength=len(probabilities)) / 8000
        assert np.abs(shares - probabilities).max() < 0.025


@pytest.mark.slow
def test_moved_particles_agree_with_plain_importance_sampling() -> None:
    # The reference weights 100,000 particles of the prior by the likelihood of all trials at once.
    trials = evenly(cohort("gaussian", 3, 0)[2], 6)[:4]
    reference = after(ParticleModel(particles=100_000, moves=Moving(sweeps=0, min_ess=0.0)), trials, 0)
    ess = 1.0 / np.exp(2 * reference.swarm.log_weights).sum()
    assert ess > 500
    expected = reference.estimate()
    got = [after(ParticleModel(particles=1000), trials, seed).estimate() for seed in range(4)]
    scale = spread_ms(expected)
    medians = np.median([np.median(known(e.edge_samples_ms), axis=0) for e in got], axis=0)
    assert np.abs((medians - [expected.start_ms, expected.end_ms]) / scale).max() < 0.2
    assert np.mean([e.probability for e in got]) == pytest.approx(expected.probability, abs=0.03)


@pytest.mark.slow
def test_the_order_of_trials_matters_little() -> None:
    # Startle and drift are the only things in the model that know the order. Averaged over six seeds.
    trials = evenly(cohort("gaussian", 3, 0)[2], 16)
    forth, back = (
        [after(ParticleModel(), order, seed).estimate() for seed in range(6)] for order in (trials, trials[::-1])
    )
    gap = np.abs(mean_medians_ms(forth) - mean_medians_ms(back))
    assert (gap < 0.5 * spread_ms(forth[0])).all()


def test_a_clear_responder_is_found_and_a_non_responder_is_not_given_a_window() -> None:
    clear = after(ParticleModel(), evenly(cohort("gaussian", 3, 0)[2], 24)).estimate()
    nonresponder = after(ParticleModel(), evenly(cohort("nonresponder", 1, 0)[0], 24)).estimate()
    assert known(clear.probability) > 0.95
    assert clear.window is not None
    assert known(nonresponder.probability) < 0.5
    assert nonresponder.window is None


@pytest.mark.slow
def test_the_unit_of_the_amplitude_is_learnt() -> None:
    # The prior of the floor, and particles far out in it, pull by less than a posterior SD, averaged over 20 seeds:
    # where amplitudes are ten times the usual, the median of one seed differs from that of another by 9 ms (SD).
    trials = evenly(cohort("gaussian", 3, 0)[2], 20)

    def found(factor: float) -> list[WindowEstimate]:
        scaled = [(isi_ms, factor * mep_mv) for isi_ms, mep_mv in trials]
        return [after(ParticleModel(), scaled, seed).estimate() for seed in range(20)]

    usual = found(1.0)
    for factor, most_sds in ((10.0, 1.6), (1 / 3, 1.0)):  # ten times: 1.2 ± .07 (decision 34)
        scaled = found(factor)
        assert min(known(e.probability) for e in scaled) > 0.9
        gap = np.abs(mean_medians_ms(usual) - mean_medians_ms(scaled))
        assert (gap < most_sds * spread_ms(usual[0])).all()


@pytest.mark.parametrize(
    "trials",
    [
        [(250.0, 0.02)] * 20,
        [(250.0, 0.0)] * 20,
        [(100.0, 0.0), (300.0, 0.0)] * 10,
        [(250.0, 0.01), (300.0, 50.0), (200.0, 0.01)],
        [(0.0, 0.01), (500.0, 0.3)] * 5,
        [(-10.0, 0.01), (510.0, 0.02)],
    ],
)
def test_data_that_break_things_give_finite_estimates(trials: list[tuple[float, float]]) -> None:
    posterior = after(ParticleModel(particles=300), trials)
    estimate = posterior.estimate()
    assert 0 <= known(estimate.probability) <= 1
    assert np.isfinite(posterior.swarm.crowd.log_likelihood).all()
    mass = posterior.outcome_mass(GRID)
    assert np.isfinite(mass).all()
    np.testing.assert_allclose(mass.sum(-1), 1.0, rtol=1e-5)


def test_tms_alone_teaches_the_baseline_and_nothing_about_the_window() -> None:
    model = ParticleModel()
    posterior = model.begin(VALVE_SPACE, 1)
    before = posterior.sample.fields[..., LOG_FLOOR].std()
    for mep_mv in (0.009, 0.011, 0.010, 0.008):
        posterior = model.update(posterior, observation([math.nan], [mep_mv]))
    assert posterior.sample.fields[..., LOG_FLOOR].std() < before / 3
    assert abs(known(posterior.estimate().probability) - Prior().profile.p_window) < 0.08


def test_responses_seen_or_not_are_learnt_from() -> None:
    model = ParticleModel()
    posterior = model.begin(VALVE_SPACE, 1)
    for isi_ms in (190.0, 230.0, 270.0, 310.0, 350.0, 390.0, 430.0) * 3:
        seen = float(240 <= isi_ms <= 360)
        posterior = model.update(posterior, observation([isi_ms], [math.nan], [seen]))
    estimate = posterior.estimate()
    assert estimate.window is not None
    assert 190 < estimate.window.start_ms < 270
    assert 310 < estimate.window.end_ms < 430


def test_resampling_leaves_particles_to_a_rare_hypothesis_and_its_probability_as_it_is() -> None:
    model = ParticleModel(particles=4000, moves=Moving(sweeps=0, min_ess=1.0))
    posterior = model.begin(VALVE_SPACE, 1)
    changed = posterior.swarm.latents.change > 0
    log_weights = log_softmax(np.where(changed, -9.0, 0.0), axis=-1)
    probability = np.exp(log_weights)[changed].sum()
    assert probability < 1e-4
    swarm = replace(posterior.swarm, crowd=posterior.swarm.crowd._replace(log_weights=log_weights))
    nothing = neutral(1)[np.newaxis]
    nothing[..., 2], nothing[..., 3] = -np.inf, np.inf
    moved = swarm.after(History(nothing), posterior.law, model.moves, 1)
    changed = moved.latents.change > 0
    assert changed.mean() > 0.1  # eight hypotheses, each with three in a hundred before the shares sum to one
    assert np.exp(moved.log_weights)[changed].sum() == pytest.approx(probability, rel=0.1)
    assert moved.latents.present.mean() == pytest.approx(model.prior.profile.p_window, abs=0.1)


def test_systematic_picks_are_as_frequent_as_their_weights() -> None:
    weights = np.array([[0.1, 0.6, 0.3]])
    picks = systematic(np.log(weights), 1000)
    np.testing.assert_allclose(np.bincount(picks[0]) / 1000, weights[0], atol=1.1e-3)


@pytest.mark.parametrize(
    ("trials", "resampled", "sweeps"), [(1, True, 6), (1, False, 1), (60, True, 4), (200, True, 1), (240, False, 1),
                                        (300, False, 1), (301, False, 0), (301, True, 1), (2000, False, 0)],
)  # fmt: skip
def test_sweeps_follow_resampling_and_a_long_history_has_few(trials: int, *, resampled: bool, sweeps: int) -> None:
    assert Moving().sweeps_after(trials, resampled=resampled) == sweeps
    assert Moving(sweeps=0).sweeps_after(trials, resampled=resampled) == 0


@pytest.mark.slow
def test_people_of_its_own_have_windows_as_often_as_believed_and_meps_of_their_own() -> None:
    # A small excess does not count as a window, so that a few less have one than believed.
    model = ParticleModel()
    isis_ms = np.array([math.nan, 250.0])
    people = [model.simulate(VALVE_SPACE, seed, isis_ms) for seed in range(1000)]
    assert 0.65 < np.mean([person.window is not None for person in people]) < 0.74  # .697 ± .015
    np.testing.assert_array_equal(people[3].mep_mv, model.simulate(VALVE_SPACE, 3, isis_ms).mep_mv)
    inside, outside = (
        np.median([p.mep_mv[1] for p in people if p.window is not None and bool(p.window.mask([250.0])[0]) is there])
        for there in (True, False)
    )
    assert inside > 2 * outside


@pytest.mark.slow
def test_intervals_hold_what_they_promise_on_the_models_own_people() -> None:
    # People drawn from the prior, whose MEPs are drawn from their own predictive distribution; 200 people, 20 trials at
    # even ISIs. The 90 % intervals of 200 honest posteriors cover 0.83 to 0.96 (99.8 %).
    rng, prior = np.random.default_rng(11), Prior(ProfilePrior(p_window=1.0))
    case, model = Case(prior, VALVE_SPACE), ParticleModel(prior=prior)
    hidden = case.drawn(1, 11, people=200)
    posterior = model.begin(VALVE_SPACE, 12, people=200)
    isis_ms = rng.permutation(np.linspace(170, 440, 20)).astype(np.float32)
    fields = case.fields(hidden)
    meps_mv = np.stack([drawn_mep_mv(fields[i : i + 1], isis_ms, rng) for i in range(200)])
    for isi_ms, each_mv in zip(isis_ms.tolist(), meps_mv.T, strict=True):
        posterior = model.update(posterior, observation([isi_ms] * 200, each_mv.tolist()))
    masks = PersonSample(case.fields(hidden, 20), VALVE_SPACE).window_masks(grid_of(VALVE_SPACE))[:, 0]
    windows = [Window.from_mask(VALVE_SPACE.grid_ms, mask) for mask in masks]
    pairs = [(posterior.estimate(i), window) for i, window in enumerate(windows) if window is not None]
    covered = np.array([covers(estimate, window, VALVE_SPACE) for estimate, window in pairs])
    assert len(covered) > 150
    assert ((covered.mean(0) > 0.83) & (covered.mean(0) < 0.96)).all()


@pytest.mark.parametrize(
    "wrong", [{"particles": 1}, {"particles": 2.5}, {"particles": 100_001}, {"thinned": 0}, {"detection_limit_mv": 0.0}]
)
def test_an_invalid_model_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        ParticleModel(**wrong)


def test_a_model_may_have_as_many_particles_as_anything_may_be_counted() -> None:
    assert ParticleModel(particles=100_000).particles == 100_000


@pytest.mark.parametrize("wrong", [{"sweeps": -1}, {"max_trial_sweeps": 0.5}, {"min_ess": 1.5}])
def test_invalid_moves_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        Moving(**wrong)


@pytest.mark.parametrize("isi_ms", [180.0, 260.0, 330.0, 450.0])
def test_mutual_information_agrees_with_that_of_the_law_on_a_fine_grid(isi_ms: float) -> None:
    posterior = after(ParticleModel(thinned=128), [(100.0, 0.01), (250.0, 0.09), (280.0, 0.12), (400.0, 0.012)])
    log_mep = np.linspace(math.log(1e-4), math.log(50.0), 2001)
    made = np.tile(neutral(posterior.trials + 1)[-1], (2001, 1, 1))
    made[..., 0], made[..., 2], made[..., 3] = isi_ms, log_mep[:, np.newaxis], log_mep[:, np.newaxis]
    each = np.exp(log_likelihoods(np.tile(posterior.sample.fields, (2001, 1, 1)), made), dtype=float)
    each /= each.sum(0)
    mean = each.mean(-1, keepdims=True)
    expected = (each * np.log(each / mean)).sum(0).mean()
    assert MutualInformation()(posterior, np.array([isi_ms])).item() == pytest.approx(expected, abs=0.02)


def test_isis_are_chosen_with_the_usual_more_probable_and_the_rest_is_believed_as_ever() -> None:
    model = ParticleModel(particles=20_000, thinned=20_000, unusual_kept=0.1)
    posterior = model.begin(VALVE_SPACE, 1)
    asking = posterior.as_usual
    usual = replace(model, prior=model.prior_where_asking).begin(VALVE_SPACE, 1)
    late = GRID > 400.0
    believed, expected, reached = (
        float(p.window_masks(GRID).mean((0, 1))[late].sum()) for p in (posterior, usual, asking)
    )
    assert expected < 0.6 * believed
    assert reached == pytest.approx(expected, rel=0.1)
    assert asking.trials == posterior.trials
    assert asking.swarm.crowd.values is posterior.swarm.crowd.values
    assert np.exp(asking.swarm.log_weights).sum() == pytest.approx(1.0)


@pytest.mark.slow
def test_a_window_that_trials_show_to_be_late_is_asked_about_all_the_same() -> None:
    trials = [(isi_ms, 0.3 if 300 <= isi_ms <= 400 else 0.008) for isi_ms in range(0, 500, 25)]
    away_ms = []
    for seed in range(6):
        posterior = after(ParticleModel(), [(float(isi_ms), mep_mv) for isi_ms, mep_mv in trials], seed)
        weights, start_ms = np.exp(posterior.as_usual.swarm.log_weights), posterior.swarm.latents.of("start_ms")
        away_ms.append((weights * np.abs(start_ms - 300.0)).sum())
    assert np.mean(away_ms) < 40.0


def test_where_everything_is_kept_isis_are_chosen_with_what_is_believed() -> None:
    posterior = after(ParticleModel(unusual_kept=1.0), [(250.0, 0.1), (100.0, 0.01)])
    np.testing.assert_allclose(posterior.as_usual.swarm.log_weights, posterior.swarm.log_weights)
    with pytest.raises(InvalidValueError, match="unusual_kept"):
        ParticleModel(unusual_kept=1.5)
