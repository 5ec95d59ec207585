"""What the engine computes of particles holds whatever the law is; its law is compared in tests/native."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import scipy.special

from isiw.design import VALVE_SPACE
from isiw.models.particles import ParticleModel
from isiw.models.particles.compiled import Crowd
from isiw.models.particles.latents import Latents
from isiw.models.particles.noise import NoiseKind, recruits
from isiw.models.particles.records import (
    BOOST,
    DRIFT,
    FLOOR_SD,
    LOG_FLOOR,
    LOG_RATIO,
    OUTPUT_SD,
    PRESENT,
    REST,
    SLOPE,
    SPREAD,
    STARTLED,
)
from isiw.models.protocol import Observation
from isiw.models.shared.draws import systematic
from isiw.models.shared.history import COUNTS, Circumstances, History, neutral
from isiw.native.engine import UNKNOWN, log_likelihoods
from isiw.types import FloatArray, Singles
from native import reference
from native.drawn import CASES, Case, columns, elementary, history, seeds, sweeps, trials

KINDS = {kind.name: kind for kind in NoiseKind}


def crowd_of(case: Case, latents: Latents) -> Crowd:
    """Particles of equal weights that have learnt nothing, as a crowd of their own."""
    people, particles = latents.kinds.shape[:2]
    nothing = np.zeros((people, particles), dtype=np.float32)
    equal = np.full((people, particles), -math.log(particles))
    return Crowd(latents.values.copy(), latents.kinds.copy(), equal, nothing, case.law.nothing_known(people, particles))


def moved(case: Case, latents: Latents, told: History, numbers: Sequence[int], seed: int) -> tuple[Latents, Any, Any]:
    """Particles after so many sweeps each, their log likelihoods, and the counts of their moves."""
    people, particles = latents.kinds.shape[:2]
    values, kinds = latents.values.copy(), latents.kinds.copy()
    log_likelihood = log_likelihoods(case.fields(latents), told.columns)
    state = values, kinds, log_likelihood, case.law.nothing_known(people, particles)
    counts = sweeps(case.law, np.array(numbers), told.columns, seeds(seed, people), state)
    return Latents(values, kinds), log_likelihood, counts


def test_no_trials_say_nothing() -> None:
    case = CASES["default"]
    assert not log_likelihoods(case.fields(case.drawn(20, 1, people=2)), History.empty(2).columns).any()


def test_long_histories_are_summed_piece_by_piece() -> None:
    case, told = CASES["default"], trials(400, np.random.default_rng(1))
    drawn = case.of_all_kinds(4, 1)
    got = log_likelihoods(case.fields(drawn), columns(told))[0]
    expected = [reference.log_likelihood(one, told) for one in case.particles(drawn)]
    np.testing.assert_allclose(got, expected, rtol=1e-5)


def few_trials(times: int) -> History:
    """Four trials with a window of about 60 to 120 ms, so many times, each of which counts as much less."""
    made = neutral(4 * times)
    made[:, 0] = np.tile([20.0, 80.0, 110.0, 160.0], times)
    made[:, 2] = made[:, 3] = np.tile(np.log([0.02, 0.1, 0.05, 0.02]), times)
    made[:, 4], made[:, COUNTS] = np.arange(4 * times), 1.0 / times
    return History(made[np.newaxis])


@pytest.mark.slow
@pytest.mark.parametrize("times", [1, 4])
@pytest.mark.parametrize("name", CASES)
def test_moves_leave_the_posterior_of_weighted_particles_of_the_prior_as_it_is(name: str, times: int) -> None:
    # From eight trials on moves are decided in two steps, the first by a part of the trials.
    # 4,000 particles that stand for 400,000 of the prior, weighted, after 40 sweeps: means differ by less than five
    # standard errors of 200 independent particles, and shares of the kinds by less than .05.
    case, told = CASES[name], few_trials(times)
    drawn = case.drawn(400_000, 3)
    log_weights = log_likelihoods(case.fields(drawn), told.columns).astype(float)
    weights = scipy.special.softmax(log_weights, axis=-1)[0]
    assert 1.0 / np.square(weights).sum() > 1000
    start = drawn.taken(np.random.default_rng(4).permuted(systematic(log_weights, 4000), axis=-1))
    found, log_likelihood, counts = moved(case, start, told, [40], 5)
    assert 0.05 < counts[0, 1] / counts[0, 0] < 1
    assert 0.02 < counts[0, 3] / counts[0, 2] < 1
    means = weights @ drawn.values[0]
    spread = np.sqrt(weights @ np.square(drawn.values[0] - means))
    assert (np.abs(found.values[0].mean(0) - means) / spread).max() < 5.0 / math.sqrt(200)
    for ours, theirs in zip(found.kinds[0].T, drawn.kinds[0].T, strict=True):
        shares = np.bincount(ours, minlength=5) / 4000
        np.testing.assert_allclose(shares, np.bincount(theirs, weights, minlength=5), atol=0.05)
    assert log_likelihood.mean() == pytest.approx(weights @ log_weights[0], abs=0.5)


def test_each_person_moves_as_often_as_they_need() -> None:
    case, told = CASES["default"], history(3, 6, 4)
    latents = case.drawn(100, 3, people=3)
    found, log_likelihood, _ = moved(case, latents, told, [3, 0, 1], 5)
    changed = (found.values != latents.values).any(-1).mean(-1)
    assert changed[0] > changed[2] > changed[1] == 0.0
    expected = log_likelihoods(case.fields(found), told.columns)
    np.testing.assert_allclose(log_likelihood, expected, atol=1e-3, rtol=1e-4)


def test_densities_of_blocks_kept_from_trial_to_trial_are_those_of_the_particles() -> None:
    posterior, kept = ParticleModel(particles=200).begin(VALVE_SPACE, 3, people=2), 0
    for trial, isi_ms in enumerate((230.0, 100.0, 250.0, 400.0, 210.0, 270.0)):
        mep_mv = 0.2 if isi_ms > 200.0 else 0.012
        posterior = posterior.model.update(posterior, Observation.of([isi_ms, 230.0], [mep_mv, 0.015]))
        posterior = posterior.noting_change() if trial == 3 else posterior
        crowd, law = posterior.swarm.crowd, posterior.law
        forgotten = crowd._replace(densities=law.nothing_known(*crowd.log_weights.shape))
        with_them, without = (law.usual_weights(posterior.usual, each) for each in (crowd, forgotten))
        np.testing.assert_array_equal(with_them, without)
        kept += bool((crowd.densities < UNKNOWN).any())
    assert kept == 5


def test_people_of_a_batch_have_the_likelihood_that_each_has_alone() -> None:
    case, told = CASES["default"], history(3, 30, 5)
    fields = case.fields(case.drawn(40, 5, people=3))
    together = log_likelihoods(fields, told.columns)
    for person in range(3):
        one = slice(person, person + 1)
        np.testing.assert_array_equal(log_likelihoods(fields[one], told.columns[one]), together[one])


@pytest.mark.parametrize("known_log_sd", [0.0, 0.6])
def test_a_trial_weighs_particles_by_its_likelihood(known_log_sd: float) -> None:
    case, told = CASES["default"], history(2, 3, 6, known_mv=0.02, known_log_sd=known_log_sd)
    latents, none = case.drawn(500, 6, people=2), np.zeros(2, dtype=np.uint64)
    crowd, evidence = crowd_of(case, latents), np.zeros(2)
    for trials_so_far in (1, 2, 3):
        found = case.law.learn(told.columns[:, :trials_so_far].copy(), 0.0, (0, 0), none, crowd)
        evidence += found[:, 0]
    expected = log_likelihoods(case.fields(latents), told.columns).astype(float)
    weights = scipy.special.log_softmax(expected, axis=-1)
    np.testing.assert_array_equal(crowd.values, latents.values)
    np.testing.assert_allclose(crowd.log_weights, weights, atol=1e-3)
    np.testing.assert_allclose(evidence, scipy.special.logsumexp(expected, axis=-1) - math.log(500), atol=1e-3)
    np.testing.assert_allclose(found[:, 1], 1.0 / np.exp(2 * weights).sum(-1) / 500, rtol=1e-3)


def test_only_those_whose_particles_have_worn_out_are_resampled() -> None:
    case, latents = CASES["default"], CASES["default"].drawn(500, 7, people=2)
    crowd, made = crowd_of(case, latents), np.stack([neutral(1)] * 2)
    made[:, 0, 0], made[:, 0, 2:4] = 230.0, [[math.log(3.0)] * 2, [-math.inf, math.inf]]
    ess = case.law.learn(made, 0.5, (0, 0), seeds(7, 2), crowd)[:, 1]
    assert ess[0] < 0.5 < ess[1]
    assert (crowd.values[0] != latents.values[0]).any()
    np.testing.assert_array_equal(crowd.values[1], latents.values[1])
    whose = (crowd.values[0, :, np.newaxis] == latents.values[0]).all(-1)
    assert whose.any(-1).all()  # each is one of those there were
    log_likelihood = log_likelihoods(case.fields(Latents(crowd.values, crowd.kinds)), made)
    np.testing.assert_allclose(crowd.log_likelihood, log_likelihood, atol=1e-4)
    np.testing.assert_allclose(np.exp(crowd.log_weights).sum(-1), 1.0)


def test_weighted_particles_are_represented_by_evenly_spaced_picks() -> None:
    case, rng = CASES["default"], np.random.default_rng(8)
    latents, log_weights = case.drawn(300, 8, people=2), 3.0 * rng.standard_normal((2, 300))
    nothing = np.zeros((2, 300), dtype=np.float32)
    crowd = Crowd(*latents, log_weights, nothing, case.law.nothing_known(2, 300))
    picks, fields = case.law.represent(crowd, 70, 9)
    np.testing.assert_array_equal(picks, systematic(log_weights, 70))
    meant = case.fields(latents, 9)
    np.testing.assert_array_equal(fields, np.take_along_axis(meant, picks[..., np.newaxis], axis=1))


# What else bears on a trial: neutral in every history, and for each field something that it must equal.


def of_kind(kind: NoiseKind) -> tuple[Singles, History]:
    """Particles with a kind of noise and no change, and trials of theirs."""
    case = CASES["by levels" if kind == NoiseKind.BY_LEVELS else "default"]
    latents = case.drawn(60, 7, people=2).with_kind("change", np.zeros((2, 60), dtype=np.int64))
    return case.fields(latents.with_kind("noise", np.full((2, 60), kind))), history(2, 20, 7)


def with_circumstances(told: History, **fields: float) -> History:
    around = told.columns.copy()
    around[..., 5:] = Circumstances(**fields)
    return History(around)


def likelihood(fields: Singles, told: History) -> Singles:
    return log_likelihoods(fields, told.columns)


def with_field(fields: Singles, field: int, values: Any) -> Singles:
    changed = fields.copy()
    changed[..., field] = values
    return changed


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_stronger_pulse_moves_up_a_recruitment_curve_and_is_nothing_to_others(kind: NoiseKind) -> None:
    fields, told = of_kind(kind)
    higher = with_field(fields, REST, fields[..., REST] + 5.0 * fields[..., SLOPE])
    got = likelihood(fields, with_circumstances(told, shift_pct_rmt=5.0))
    np.testing.assert_allclose(got, likelihood(higher, told), atol=1e-3)
    assert (got != likelihood(fields, told)).any() == (bool(recruits(np.array(kind))))


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_what_curves_alone_have_a_law_of_is_to_other_kinds_as_curves_predict_it(kind: NoiseKind) -> None:
    fields, told = of_kind(kind)
    got = likelihood(fields, with_circumstances(told, shift_pct_rmt=5.0, log_by_curves=-1.5))
    curved = bool(recruits(np.array(kind)))
    expected = likelihood(fields, with_circumstances(told, shift_pct_rmt=5.0)) if curved else -1.5 * told.trials
    np.testing.assert_allclose(got, expected, rtol=1e-5)


def test_a_mistaken_known_part_is_paid_for_once_and_not_in_each_trial() -> None:
    # MEPs of TMS alone that are exp(2) times the known part, at one ISI or at ISIs far from each other.
    nobody = with_field(of_kind(NoiseKind.MISSING)[0], PRESENT, 0.0)

    def lost(isi_ms: Sequence[float]) -> tuple[float, float]:
        made = np.stack([neutral(len(isi_ms))] * 2)
        made[..., 0], made[..., 2:4] = isi_ms, math.log(0.25)
        right, wrong, open_to = (
            np.median(
                likelihood(
                    nobody, with_circumstances(History(made), known_mv=mv, known_sd_mv=0.2 * mv, known_log_sd=sd)
                )
            )
            for mv, sd in ((0.25, 0.0), (0.25 * math.exp(-2.0), 0.0), (0.25 * math.exp(-2.0), 1.0))
        )
        return float(right - wrong), float(right - open_to)

    closed, at_one_isi = lost([100.0] * 8)
    _, at_eight = lost([100.0 + 20.0 * number for number in range(8)])
    assert 2.0 < at_one_isi < 4.0
    assert at_eight == pytest.approx(8 * at_one_isi, rel=0.1)
    assert closed > 1.2 * at_eight


@pytest.mark.parametrize("sd_mv", [0.0, 0.02])
def test_a_known_part_is_added_to_floor_and_response(sd_mv: float) -> None:
    # One particle of a recruitment curve, by its distribution function over 200,000 simulated trials.
    rng, fields = np.random.default_rng(3), of_kind(NoiseKind.RECRUITMENT)[0][:1, :1].copy()
    set_to = {LOG_FLOOR: math.log(0.01), FLOOR_SD: 0.2, LOG_RATIO: math.log(16.0), SPREAD: 1.0, OUTPUT_SD: 0.3}
    for field, value in (set_to | {REST: -1.0, BOOST: 0.0, DRIFT: 0.0, STARTLED: 0.0, PRESENT: 1.0}).items():
        fields[..., field] = value
    z = rng.standard_normal((4, 200_000))
    evoked_mv = 0.16 / (1.0 + np.exp(1.0 - z[0])) * np.exp(0.3 * z[1])
    mep_mv: FloatArray = 0.01 * np.exp(0.2 * z[2]) + evoked_mv + 0.08 + sd_mv * z[3]
    for end_mv in (0.1, 0.13, 0.16, 0.2):
        made = neutral(10)[np.newaxis, 9:].copy()
        made[..., 0], made[..., 2], made[..., 3] = np.nan, -np.inf, math.log(end_mv)
        told = with_circumstances(History(made), known_mv=0.08, known_sd_mv=sd_mv)
        # Three of a hundred trials are outliers to the model; the rest is its log-normal sum.
        assert np.exp(likelihood(fields, told)).item() == pytest.approx((mep_mv < end_mv).mean(), abs=0.06)


def test_the_elementary_functions_are_those_of_numpy() -> None:
    x = np.linspace(-30.0, 30.0, 401).astype(np.float32)
    positive = np.exp(x)
    np.testing.assert_allclose(elementary("exp", x), np.exp(x.astype(float)), rtol=3e-6)
    np.testing.assert_allclose(elementary("exp2", x), np.exp2(x.astype(float)), rtol=3e-6)
    np.testing.assert_allclose(elementary("log", positive), np.log(positive.astype(float)), rtol=2e-6, atol=1e-7)
    np.testing.assert_allclose(elementary("per", positive), 1.0 / positive.astype(float), rtol=4e-7)
    np.testing.assert_allclose(elementary("per_root", positive), positive.astype(float) ** -0.5, rtol=4e-7)


@pytest.mark.parametrize("name", CASES)
def test_sweeps_one_by_one_lead_where_sweeps_at_once_do(name: str) -> None:
    # Within a call log densities of blocks are kept from sweep to sweep; each call works them out again.
    case, told, found = CASES[name], history(1, 8, 4), list[tuple[Any, ...]]()
    latents = case.drawn(300, 3)
    start = log_likelihoods(case.fields(latents), told.columns)
    for number, calls in ((6, 1), (1, 6)):
        values, kinds, log_likelihood = latents.values.copy(), latents.kinds.copy(), start.copy()
        dice, counts = np.full(1, 7, dtype=np.uint64), np.zeros((1, 4), dtype=np.float32)
        for _ in range(calls):
            state = values, kinds, log_likelihood, case.law.nothing_known(1, 300)
            counts += sweeps(case.law, np.array([number]), told.columns, dice, state)
        found.append((values, kinds, log_likelihood, counts))
    for together, one_by_one in zip(*found, strict=True):
        np.testing.assert_array_equal(together, one_by_one)
