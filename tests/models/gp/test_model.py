"""The Gaussian process as a model: it conforms, finds windows, finds none where there is none, and is honest."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError, StrategyError
from isiw.estimate import WindowEstimate
from isiw.models.gp.model import GaussianProcess, GaussianProcessPosterior
from isiw.models.gp.prior import FixedProcess, ProcessSettings
from isiw.models.protocol import (
    Conditions,
    HasBotorchModel,
    HasEvidence,
    Observation,
    PredictsOutcomes,
    ReportsTrouble,
    SamplesProfiles,
    SamplesWindows,
)
from isiw.models.shared.history import FloorTreatment
from isiw.studies import SimulatedSession, run_study
from isiw.subjects.cohorts import cohort
from isiw.testing import check_model
from isiw.testing.suites import usual_trials
from known import known

FEW = GaussianProcess(samples=64)
FIXED = FixedProcess(length_ms=40.0, amplitude=1.1, noise=0.6, centre=-3.8, unit=0.9)
GRID = np.linspace(0.0, 500.0, 51)

Trials = list[tuple[float | None, float]]


def observation(isi_ms: float | None, mep_mv: float, response: float = math.nan) -> Observation:
    return Observation.of([isi_ms], [mep_mv], response=None if math.isnan(response) else [bool(response)])


def after(
    model: GaussianProcess, trials: Trials, space: DesignSpace = VALVE_SPACE, seed: int = 1
) -> GaussianProcessPosterior:
    posterior = model.begin(space, seed)
    for isi_ms, mep_mv in trials:
        posterior = model.update(posterior, observation(isi_ms, mep_mv))
    return posterior


def evenly(name: str, n: int, person: int = 0) -> Trials:
    responder = cohort(name, person + 1, 0)[person].begin(person)
    order = np.random.default_rng(person).permutation(np.linspace(5, 495, n).round()).tolist()
    return [(isi_ms, responder.respond(isi_ms, "valve").mep_mv) for isi_ms in order]


def flat(n: int, seed: int) -> Trials:
    rng = np.random.default_rng(seed)
    return list(zip(rng.uniform(0, 500, n).tolist(), rng.lognormal(math.log(0.01), 0.4, n).tolist(), strict=True))


def estimate(model: GaussianProcess, trials: Trials) -> WindowEstimate:
    return after(model, trials).estimate()


@pytest.mark.slow
@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"process": ProcessSettings(kernel="rbf")},
        {"process": ProcessSettings(noise="by-isi", max_evaluations=40)},
        {"process": ProcessSettings(hyperparameters="map")},
        {"transform": "sqrt", "process": ProcessSettings(noise="by-isi", hyperparameters="map", max_evaluations=40)},
        {"transform": "none", "floor": FloorTreatment("raw")},
        {"floor": FloorTreatment("zeroed")},
        {"process": ProcessSettings(fixed=FIXED)},
    ],
    ids=str,
)
def test_it_conforms(changed: dict[str, Any]) -> None:
    check_model(lambda: replace(FEW, samples=16, **changed), VALVE_SPACE)


@pytest.mark.slow
def test_it_conforms_from_the_impact_and_in_a_narrow_space() -> None:
    for space in (IMPACT_SPACE, DesignSpace(20, 60, reference="impact")):
        check_model(lambda: replace(FEW, samples=16), space)


def test_it_has_the_capabilities_that_it_says() -> None:
    posterior = FEW.begin(VALVE_SPACE, 0)
    for capability in (
        PredictsOutcomes,
        SamplesWindows,
        SamplesProfiles,
        Conditions,
        HasEvidence,
        ReportsTrouble,
        HasBotorchModel,
    ):
        assert isinstance(posterior, capability)


@pytest.mark.slow
def test_it_finds_the_window_of_clear_people() -> None:
    for person in (0, 1, 2, 4, 5):
        found = estimate(GaussianProcess(), evenly("gaussian", 40, person))
        truth = known(cohort("gaussian", person + 1, 0)[person].window(VALVE_SPACE))
        assert known(found.probability) > 0.9
        assert known(found.window).start_ms < truth.start_ms + 0.4 * truth.width_ms
        assert known(found.window).end_ms > truth.end_ms - 0.4 * truth.width_ms


@pytest.mark.slow
def test_a_flat_profile_is_mostly_said_to_have_no_window() -> None:
    probabilities = np.array([estimate(FEW, flat(40, seed)).probability for seed in range(40)])
    assert (probabilities >= 0.5).mean() <= 0.15
    assert (probabilities >= 0.9).mean() <= 0.025


@pytest.mark.slow
def test_a_flat_profile_becomes_ever_more_certain_to_be_flat() -> None:
    few, many = (np.mean([estimate(FEW, flat(n, seed)).probability for seed in range(20)]) for n in (8, 60))
    assert many < 0.5 * few


def test_without_trials_it_believes_what_was_believed_before() -> None:
    # Of the paths that change something, some rise too little to have a window.
    probability = known(FEW.begin(VALVE_SPACE, 0).estimate().probability)
    assert 0.6 < probability <= FEW.process.prior.p_window + 0.01


def test_told_baselines_are_the_floor() -> None:
    trials = evenly("gaussian", 30)
    told = after(FEW, [*trials, *[(None, 0.02 * math.exp(0.2 * (-1) ** k)) for k in range(20)]])
    assert np.median(told.baselines_mv()) == pytest.approx(0.021, rel=0.25)
    assert np.median(after(FEW, trials).baselines_mv()) < 0.015


def test_amplitudes_below_the_threshold_are_zero_where_the_floor_is_zeroed() -> None:
    model = GaussianProcess(floor=FloorTreatment("zeroed", 0.03))
    trials = evenly("gaussian", 40)
    zeroed = [(isi_ms, 0.0 if mep_mv < 0.03 else mep_mv) for isi_ms, mep_mv in trials]
    one, other = (after(model, told) for told in (trials, zeroed))
    np.testing.assert_array_equal(one.profiles_mv(GRID), other.profiles_mv(GRID))
    assert (one.baselines_mv() == 0).all()
    assert one.estimate().window is not None


def test_the_model_for_botorch_agrees_with_scikit_learn() -> None:
    trials = evenly("gaussian", 30)
    isis_ms, meps_mv = (np.array(column) for column in zip(*trials, strict=True))
    kernel = ConstantKernel(FIXED.amplitude**2) * Matern(FIXED.length_ms, nu=2.5) + ConstantKernel(1.0)
    values = (np.log(np.maximum(meps_mv, 0.005)) - FIXED.centre) / FIXED.unit
    reference = GaussianProcessRegressor(kernel, alpha=FIXED.noise**2, optimizer=None).fit(isis_ms[:, None], values)
    mean, sd = reference.predict(GRID[:, None], return_std=True)
    model = after(GaussianProcess(ProcessSettings(fixed=FIXED)), trials).botorch_model()
    with torch.no_grad():
        posterior = model.posterior(torch.tensor(GRID)[:, None])
    np.testing.assert_allclose(posterior.mean[:, 0], mean, rtol=0, atol=1e-6)
    np.testing.assert_allclose(posterior.variance[:, 0].sqrt(), sd, rtol=0, atol=1e-6)


def test_conditioning_on_a_trial_is_refitting_with_it_where_hyperparameters_are_fixed() -> None:
    model, trials = replace(FEW, process=ProcessSettings(fixed=FIXED)), evenly("gaussian", 20)
    refitted = after(model, trials)
    conditioned = after(model, trials[:-1]).condition(*np.array(trials[-1:], dtype=float).T)
    np.testing.assert_array_equal(conditioned.profiles_mv(GRID), refitted.profiles_mv(GRID))
    np.testing.assert_array_equal(conditioned.window_masks(GRID), refitted.window_masks(GRID))
    np.testing.assert_array_equal(conditioned.log_evidence(), refitted.log_evidence())


def test_conditioning_keeps_the_scale_and_the_processes_and_weighs_them_anew() -> None:
    before = after(FEW, evenly("gaussian", 20))
    imagined = before.condition(np.array([250.0]), np.array([0.2]))
    (old,), (new,) = before.fits, imagined.fits
    assert new.scale == old.scale
    assert torch.equal(new.processes.length_ms, old.processes.length_ms)
    assert not torch.equal(new.log_joint, old.log_joint)
    assert imagined.trials == before.trials + 1
    assert FEW.update(imagined, observation(100.0, 0.01)).held is None


def test_people_do_not_see_each_other() -> None:
    alone = after(FEW, evenly("gaussian", 12))
    together = FEW.begin(VALVE_SPACE, 1, people=2)
    for (isi_ms, mep_mv), (other_ms, other_mv) in zip(evenly("gaussian", 12), flat(12, 0), strict=True):
        together = FEW.update(together, Observation.of([isi_ms, other_ms], [mep_mv, other_mv]))
    assert together.people == 2
    np.testing.assert_array_equal(together.window_masks(GRID)[:1], alone.window_masks(GRID))
    assert (together.window_masks(GRID)[1] != alone.window_masks(GRID)[0]).any()


def test_all_of_the_samples_are_the_same_ones() -> None:
    # Where a sampled window is, its profile is above its floor.
    posterior = after(GaussianProcess(), evenly("gaussian", 30))
    masks, profiles, floors = posterior.window_masks(GRID), posterior.profiles_mv(GRID), posterior.baselines_mv()
    assert (profiles > floors[..., None])[masks > 0].all()


def test_a_response_without_an_amplitude_is_refused() -> None:
    with pytest.raises(StrategyError, match="amplitudes only"):
        FEW.update(FEW.begin(VALVE_SPACE, 0), observation(250.0, math.nan, response=1.0))


def test_trouble_of_a_fit_is_told_and_an_estimate_is_given() -> None:
    hasty = replace(FEW, process=ProcessSettings(hyperparameters="map", max_evaluations=5))
    posterior = after(hasty, list(usual_trials(VALVE_SPACE)))
    assert known(posterior.trouble).startswith("The search")
    assert known(posterior.trouble).endswith(".")
    assert posterior.estimate().window is not None
    assert after(FEW, list(usual_trials(VALVE_SPACE))).trouble is None


@pytest.mark.parametrize(
    "changed", [{"transform": "log10"}, {"samples": 1}, {"samples": 2.5}, {"detection_limit_mv": 0.0}], ids=str
)
def test_an_invalid_setting_is_refused(changed: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        replace(FEW, **changed)


@pytest.mark.parametrize(
    "wrong",
    [
        {"kernel": "linear"},
        {"noise": "level"},
        {"hyperparameters": "mcmc"},
        {"max_evaluations": 0},
        {"fixed": FIXED, "noise": "by-isi"},
    ],
    ids=str,
)
def test_an_invalid_process_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        ProcessSettings(**wrong)


def coverage(people: int, trials: int, strategy: str = "gp-straddle", **settings: Any) -> tuple[float, float]:
    """How often the 90 % intervals hold start and end, on smooth profiles with moderate noise."""
    sessions = [
        SimulatedSession(strategy, "gaussian", person, 600, trials, (trials,), settings=tuple(settings.items()))
        for person in range(people)
    ]
    rows = run_study(sessions)
    return rows["start_covered"].mean(), rows["end_covered"].mean()


@pytest.mark.long
def test_intervals_of_the_edges_hold_them_after_thirty_random_trials() -> None:
    # 40 people, so 80 edges: 0.80 of them, less two standard errors where 0.80 were the truth.
    assert np.mean(coverage(40, 30, acquisition="random")) > 0.71


@pytest.mark.long
@pytest.mark.parametrize("acquisition", ["random", "straddle", "integrated-variance"])
def test_intervals_of_the_edges_cover_at_least_080(acquisition: str) -> None:
    assert np.mean(coverage(100, 30, acquisition=acquisition)) >= 0.80
