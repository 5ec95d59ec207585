import math
from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np
import pytest
import torch
from scipy.stats import kstest

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError
from isiw.metrics import covers, edge_ranks, f1
from isiw.models.parametric import ParametricModel, ParametricPosterior
from isiw.models.parametric import sampling as parametric_sampling
from isiw.models.parametric.importance import Effort
from isiw.models.parametric.law import Likelihood, WindowPrior
from isiw.models.parametric.sampling import Chains
from isiw.models.parametric.tensors import Trials
from isiw.models.protocol import (
    Conditions,
    HasEvidence,
    Observation,
    Posterior,
    PredictsOutcomes,
    PriorPerson,
    ReportsTrouble,
    ResponseModel,
    SamplesProfiles,
    SamplesWindows,
    SimulatesPeople,
)
from isiw.models.shared.draws import OUTCOMES
from isiw.models.shared.scales import Scale
from isiw.subjects.cohorts import cohort
from isiw.testing import check_model
from known import known

GRID = np.arange(0.0, 501.0, 5.0)
LIKELIHOODS: tuple[Likelihood, ...] = ("gamma", "log-normal", "input-noise")


def observation(
    isi_ms: float, mep_mv: float = math.nan, response: float = math.nan, isi_sd_ms: float = 0.0
) -> Observation:
    seen = None if math.isnan(response) else [bool(response)]
    return Observation.of([isi_ms], [mep_mv], [isi_sd_ms], seen)


def after(model: ParametricModel, observations: Sequence[Observation], seed: int = 1) -> ParametricPosterior:
    return reduce(model.update, observations, model.begin(VALVE_SPACE, seed))


def evenly(name: str, person: int, n: int) -> list[Observation]:
    responder = cohort(name, 3, 0)[person].begin(0)
    isis_ms = np.random.default_rng(0).permutation(np.linspace(120, 460, n).round())
    return [observation(isi_ms, responder.respond(isi_ms, "valve").mep_mv) for isi_ms in isis_ms.tolist()]


def simulated(model: ParametricModel, seed: int, isis_ms: np.ndarray) -> tuple[PriorPerson, list[Observation]]:
    truth = model.simulate(VALVE_SPACE, seed, isis_ms)
    meps_mv = truth.mep_mv.tolist()
    return truth, [observation(isi_ms, mep_mv) for isi_ms, mep_mv in zip(isis_ms.tolist(), meps_mv, strict=True)]


def test_model_and_posterior_keep_their_protocols() -> None:
    model = ParametricModel()
    posterior = model.begin(VALVE_SPACE, 0)
    assert isinstance(model, ResponseModel)
    assert isinstance(model, SimulatesPeople)
    for protocol in (
        Posterior,
        PredictsOutcomes,
        SamplesWindows,
        SamplesProfiles,
        Conditions,
        HasEvidence,
        ReportsTrouble,
    ):
        assert isinstance(posterior, protocol)


@pytest.mark.slow
def test_the_parametric_model_conforms_whatever_the_order_of_the_trials() -> None:
    model = ParametricModel(samples=64, effort=Effort(scouts=16, starts=1, steps=2, draws=50, fits=1, enough=10))
    check_model(lambda: replace(model), IMPACT_SPACE, order_tolerance_ms=0.0)


@pytest.mark.long
@pytest.mark.parametrize("space", [VALVE_SPACE, IMPACT_SPACE], ids=["valve", "impact"])
@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_the_parametric_model_conforms_with_every_likelihood(likelihood: Likelihood, space: DesignSpace) -> None:
    check_model(lambda: ParametricModel(likelihood=likelihood), space, order_tolerance_ms=0.0)


def test_the_prior_is_sampled_as_it_is_stated() -> None:
    posterior = ParametricModel(samples=2000).begin(VALVE_SPACE, 1)
    z = posterior.drawn.latents[0]
    assert z.mean(0).abs().max() < 0.12
    assert (z.std(0) - 1).abs().max() < 0.12
    assert posterior.drawn.present.double().mean().item() == pytest.approx(WindowPrior().p_window, abs=0.01)
    assert posterior.log_evidence().item() == pytest.approx(0.0, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_the_posterior_agrees_with_plain_importance_sampling_from_the_prior(likelihood: Likelihood) -> None:
    # The reference weights 200,000 draws of the prior by the likelihood of three trials.
    model = ParametricModel(likelihood=likelihood)
    posterior = after(model, [observation(250.0, 0.08), observation(350.0, 0.012), observation(math.nan, 0.01)])
    program = model.program(VALVE_SPACE)
    z = torch.randn((200_000, program.latents), generator=torch.Generator().manual_seed(9), dtype=torch.double)
    with_, without = (
        of.log_likelihood(z, Trials.of(posterior.history)) for of in (program, replace(program, present=False))
    )
    assert torch.exp(2 * torch.logsumexp(with_, 0) - torch.logsumexp(2 * with_, 0)) > 500
    evidence = torch.stack([torch.logsumexp(x, 0) for x in (with_, without)]) + torch.tensor([0.75, 0.25]).log()
    present = posterior.drawn.present[0]
    assert present.double().mean().item() == pytest.approx(torch.softmax(evidence, 0)[0].item(), abs=0.03)
    assert posterior.log_evidence().item() == pytest.approx(
        (torch.logsumexp(evidence, 0) - math.log(len(z))).item(), abs=0.15
    )
    weights = torch.softmax(with_, 0)
    mean = weights @ z
    sd = (weights @ (z - mean).square()).sqrt()
    got = posterior.drawn.latents[0][present]
    assert ((got.mean(0) - mean) / sd).abs().max() < 0.25
    assert (got.std(0) / sd - 1).abs().max() < 0.25


@pytest.mark.slow
def test_use_in_between_leaves_the_posterior_the_same() -> None:
    model = ParametricModel(likelihood="gamma")
    observations = evenly("gaussian", 2, 6)
    used = model.begin(VALVE_SPACE, 1)
    for each in observations:
        used = model.update(used, each)
        used.estimate()
    assert torch.equal(used.drawn.latents, after(model, observations).drawn.latents)


def test_nothing_is_drawn_before_it_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("isiw.models.parametric.model.sample_person", None)
    posterior = after(ParametricModel(), evenly("gaussian", 2, 6))
    assert posterior.trials == 6
    with pytest.raises(TypeError):
        posterior.estimate()


@pytest.mark.slow
def test_people_do_not_see_each_other() -> None:
    model = ParametricModel(likelihood="gamma", samples=100)
    two = model.begin(VALVE_SPACE, 1, people=2)
    for isi_ms in (100.0, 250.0, 400.0):
        two = model.update(two, Observation.of([isi_ms] * 2, [0.01, 0.1]))
    alone = after(model, [observation(isi_ms, 0.1) for isi_ms in (100.0, 250.0, 400.0)])
    assert torch.equal(two.drawn.latents[1], alone.drawn.latents[0])
    assert two.estimate(1).probability == alone.estimate().probability


@pytest.mark.slow
@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_a_clear_responder_is_found_and_a_non_responder_is_not_given_a_window(likelihood: Likelihood) -> None:
    model = ParametricModel(likelihood=likelihood)
    clear = after(model, evenly("gaussian", 2, 24)).estimate()
    nonresponder = after(model, evenly("nonresponder", 0, 24)).estimate()
    assert known(clear.probability) > 0.95
    assert f1(clear, cohort("gaussian", 3, 0)[2].window(VALVE_SPACE), VALVE_SPACE) > 0.85
    assert known(nonresponder.probability) < 0.5
    assert nonresponder.window is None


def test_two_places_that_may_both_be_the_window_are_both_kept() -> None:
    # A response at 210 ms and one at 420 ms, and silence at 310 ms between them.
    silence = [observation(isi_ms, 0.009) for isi_ms in (60.0, 120.0, 300.0, 310.0, 320.0)]
    posterior = after(
        ParametricModel(likelihood="log-normal"), [*silence, observation(210.0, 0.08), observation(420.0, 0.08)]
    )
    masks = posterior.window_masks(np.array([210.0, 420.0]))[0].mean(0)
    assert masks.min() > 0.03
    assert masks.sum() < 1.2


def test_tms_alone_teaches_the_floor_and_nothing_about_the_window() -> None:
    model = ParametricModel(likelihood="log-normal")
    posterior = after(model, [observation(math.nan, mep_mv) for mep_mv in (0.009, 0.011, 0.010, 0.008)])
    assert np.log(posterior.baselines_mv()).std() < 0.3 * WindowPrior().floor.mean_mv.sd
    assert abs(known(posterior.estimate().probability) - WindowPrior().p_window) < 0.05


@pytest.mark.slow
def test_responses_seen_or_not_are_learnt_from() -> None:
    isis_ms = (190.0, 230.0, 270.0, 310.0, 350.0, 390.0, 430.0) * 3
    seen = [observation(isi_ms, response=float(240 <= isi_ms <= 360)) for isi_ms in isis_ms]
    window = after(ParametricModel(), seen).estimate().window
    assert window is not None
    assert 190 < window.start_ms < 270
    assert 310 < window.end_ms < 430


def test_an_amplitude_of_zero_says_that_it_is_below_the_detection_limit() -> None:
    posterior = after(ParametricModel(likelihood="gamma"), [observation(math.nan, 0.0)] * 4)
    assert np.median(posterior.baselines_mv()) < 0.006


@pytest.mark.slow
def test_an_uncertain_isi_leaves_the_edges_less_certain() -> None:
    exact = evenly("gaussian", 1, 24)
    blurred = [replace(each, isi_sd_ms=np.array([15.0], dtype=np.float32)) for each in exact]
    spreads = [
        np.std(known(after(ParametricModel(likelihood="gamma"), trials).estimate().edge_samples_ms), axis=0).sum()
        for trials in (exact, blurred)
    ]
    assert spreads[1] > 1.15 * spreads[0]


def test_a_fantasy_moves_the_samples_as_an_update_would() -> None:
    model = ParametricModel(likelihood="log-normal", samples=1000)
    before = after(model, evenly("gaussian", 2, 10))
    isi_ms, mep_mv = np.array([200.0]), np.array([0.05])
    imagined, updated = before.condition(isi_ms, mep_mv), model.update(before, observation(200.0, 0.05))
    assert imagined.trials == before.trials + 1
    assert imagined.log_evidence().item() == pytest.approx(updated.log_evidence().item(), abs=0.2)
    gaps = np.abs(imagined.profiles_mv(GRID).mean(1) - updated.profiles_mv(GRID).mean(1))
    moved = np.abs(before.profiles_mv(GRID).mean(1) - updated.profiles_mv(GRID).mean(1))
    assert gaps.max() < 0.5 * moved.max()


@pytest.mark.slow
@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_the_predicted_outcomes_have_the_expectation_of_the_profile(likelihood: Likelihood) -> None:
    # Without outliers. Outcomes lie a quarter of a nat apart and leave out the rarest MEPs, which makes 1.1 % at most.
    model = ParametricModel(prior=WindowPrior(outliers=Scale(-12.0, 0.1)), likelihood=likelihood)
    posterior = after(model, evenly("gaussian", 2, 20))
    unknowns = posterior.sample.unknowns
    low = unknowns.floor_mv.log().quantile(0.05) - 1.0
    high = (unknowns.baseline_mv + unknowns.amplitude_mv).log().quantile(0.95) + 1.5
    outcomes_mv = np.exp(np.linspace(low.item(), high.item(), OUTCOMES))
    expected_mv = posterior.outcome_mass(GRID)[0].mean(0) @ outcomes_mv
    np.testing.assert_allclose(expected_mv, posterior.profiles_mv(GRID)[0].mean(0), rtol=0.02)


@pytest.mark.slow
def test_the_unit_of_the_amplitude_is_learnt() -> None:
    usual = evenly("gaussian", 2, 20)
    scaled = [replace(each, mep_mv=10.0 * each.mep_mv) for each in usual]
    one, ten = (after(ParametricModel(likelihood="gamma"), trials).estimate() for trials in (usual, scaled))
    assert known(ten.probability) > 0.9
    spread = np.std(known(one.edge_samples_ms), axis=0)
    assert (
        np.abs(np.median(known(one.edge_samples_ms), axis=0) - np.median(known(ten.edge_samples_ms), axis=0)) < spread
    ).all()


def test_too_little_work_is_reported_with_what_stands_in_for_it() -> None:
    little = Effort(scouts=12, starts=1, steps=1, draws=10, fits=1, enough=10.0)
    posterior = after(ParametricModel(effort=little), evenly("gaussian", 2, 30))
    assert posterior.trouble is not None
    assert "worth" in posterior.trouble
    assert "flattened" in posterior.trouble
    assert posterior.trouble.endswith(".")


@pytest.mark.parametrize(
    "wrong",
    [
        {"likelihood": "normal"},
        {"method": "vi"},
        {"samples": 1},
        {"samples": 2.5},
        {"detection_limit_mv": 0.0},
        {"response_threshold_mv": -1.0},
    ],
)
def test_a_model_that_cannot_be_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        ParametricModel(**wrong)


@pytest.mark.parametrize(
    "wrong",
    [
        {"scouts": 11, "starts": 12},
        {"starts": 0},
        {"steps": 0},
        {"draws": 2.5},
        {"fits": 0},
        {"fits": True},
        {"enough": 0.0},
        {"enough": math.nan},
        {"enough": math.inf},
    ],
)
def test_effort_that_cannot_be_made_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        Effort(**wrong)


@pytest.mark.slow
@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_people_of_its_own_have_windows_as_often_as_believed_and_the_same_meps_again(likelihood: Likelihood) -> None:
    model = ParametricModel(likelihood=likelihood)
    isis_ms = np.array([math.nan, 250.0])
    people = [model.simulate(VALVE_SPACE, seed, isis_ms) for seed in range(400)]
    share = np.mean([person.window is not None for person in people])
    assert share == pytest.approx(WindowPrior().p_window, abs=0.07)
    np.testing.assert_array_equal(people[3].mep_mv, model.simulate(VALVE_SPACE, 3, isis_ms).mep_mv)
    assert all((person.mep_mv > 0).all() for person in people)


def edges_ms(model: ParametricModel, observations: Sequence[Observation]) -> np.ndarray:
    return np.median(known(after(model, observations).estimate().edge_samples_ms), axis=0)


def nuts_gap_ms(model: ParametricModel, observations: Sequence[Observation]) -> np.ndarray:
    """How far apart the medians of each edge are; two that lie beyond the range agree."""
    fast, slow = edges_ms(model, observations), edges_ms(replace(model, method="nuts"), observations)
    with np.errstate(invalid="ignore"):
        return np.where(fast == slow, 0.0, np.abs(fast - slow))


def test_chains_of_nuts_that_disagree_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def stuck(
        _program: object, _trials: object, starts: torch.Tensor, draws: int, _warmup: int, generator: torch.Generator
    ) -> torch.Tensor:
        noise = torch.randn((len(starts), draws, starts.shape[1]), generator=generator, dtype=torch.double)
        return starts.unsqueeze(1) + 0.01 * noise

    monkeypatch.setattr(parametric_sampling, "nuts_sample", stuck)
    silence = [observation(isi_ms, 0.009) for isi_ms in (60.0, 120.0, 300.0, 310.0, 320.0)]
    responses = [observation(210.0, 0.08), observation(420.0, 0.08)]
    model = ParametricModel(likelihood="log-normal", method="nuts", chains=Chains(least_share=0.0))
    trouble = after(model, [*silence, *responses]).trouble
    assert trouble is not None
    assert "R-hat" in trouble


@pytest.mark.long
def test_fast_inference_agrees_with_nuts_on_twenty_data_sets() -> None:
    model = ParametricModel(prior=WindowPrior(p_window=1.0), likelihood="log-normal", samples=300)
    gaps_ms = []
    for seed in range(20):
        _, observations = simulated(model, seed, np.random.default_rng(seed).uniform(150, 450, 30))
        gaps_ms.append(nuts_gap_ms(model, observations))
    assert np.median(gaps_ms) < 3


@pytest.mark.long
@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_ranks_of_the_true_edges_are_uniform_on_the_models_own_people(likelihood: Likelihood) -> None:
    # Simulation-based calibration (Talts et al., arXiv:1804.06788) with 200 people and 20 trials. The 90 % intervals of
    # about 150 honest posteriors cover 0.82 to 0.97 (99.8 %).
    model = ParametricModel(likelihood=likelihood)
    rng = np.random.default_rng(5)
    ranks, covered = [], []
    for seed in range(200):
        truth, observations = simulated(model, seed, rng.uniform(150, 450, 20))
        estimate = after(model, observations, seed).estimate()
        if truth.window is None:
            continue
        ranks.append(edge_ranks(estimate, truth.window, VALVE_SPACE, rng))
        covered.append(known(covers(estimate, truth.window, VALVE_SPACE)))
    assert len(ranks) > 120
    assert all(kstest(rank, "uniform").pvalue > 0.001 for rank in np.array(ranks).T)
    assert (np.abs(np.mean(covered, axis=0) - 0.895) < 0.075).all()
