"""What the regressions share: capabilities of one posterior, several people, fantasies, and the segments reported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pytest

from isiw.acquisition.variance import ProfileVariance
from isiw.design import VALVE_SPACE, DesignSpace
from isiw.dissertation.nonlinear import NonlinearRegression
from isiw.dissertation.regression import FittedCurve, RegressionModel
from isiw.errors import InvalidValueError, StrategyError
from isiw.models.protocol import (
    Conditions,
    Observation,
    PredictsOutcomes,
    ReportsTrouble,
    SamplesProfiles,
    SamplesWindows,
)
from isiw.strategy.catalogue import make_strategy
from isiw.types import FloatArray
from known import known
from models.told_trials import bell_mv, observation, told, trials_of

NR = RegressionModel(NonlinearRegression())
NOISY = [(isi, mep + 0.002 * (k % 3)) for k, (isi, mep) in enumerate(trials_of(bell_mv))]


@dataclass(frozen=True)
class TwoHumps:
    """Fits the same two humps to whatever it is told."""

    noise_mv: float = 0.01

    def fit(
        self, isi_ms: FloatArray, excess_mv: FloatArray, space: DesignSpace, rng: np.random.Generator
    ) -> FittedCurve:
        del isi_ms, excess_mv, rng
        grid = space.grid_ms
        mean = bell_mv(grid, mean_ms=150.0) + bell_mv(grid, 0.05, mean_ms=400.0)
        return FittedCurve(grid, mean, 0.1 * mean, np.stack((mean, bell_mv(grid))), self.noise_mv)


def test_a_regression_has_the_capabilities_of_the_acquisition_functions() -> None:
    posterior = told(NR, NOISY)
    for capability in (PredictsOutcomes, SamplesWindows, SamplesProfiles, Conditions, ReportsTrouble):
        assert isinstance(posterior, capability)


def test_the_samples_of_all_capabilities_are_the_same() -> None:
    posterior = told(NR, NOISY)
    grid = VALVE_SPACE.grid_ms
    excess = posterior.profiles_mv(grid) - posterior.baselines_mv()[..., None]
    inside = excess >= 0.135 * excess.max(-1, keepdims=True)
    assert (posterior.window_masks(grid) == inside).mean() > 0.999
    values = posterior.outcome_mass(grid[::50])
    assert values.shape[:3] == excess[..., ::50].shape
    np.testing.assert_allclose(values.sum(-1), 1.0, rtol=1e-5)


def test_the_less_noise_the_better_an_outcome_tells_samples_apart() -> None:
    overlaps = []
    for noise_mv in (0.01, 0.1):
        mass = RegressionModel(TwoHumps(noise_mv)).begin(VALVE_SPACE, 0).outcome_mass(np.array([150.0]))[0, :, 0]
        overlaps.append(float(mass.min(axis=0).sum()))
    assert overlaps[0] < 0.05
    assert overlaps[1] > 0.4


def test_the_next_isi_is_where_the_curve_is_least_known() -> None:
    trials = [trial for trial in NOISY if not 215.0 <= known(trial[0]) <= 255.0]
    isi_ms = VALVE_SPACE.grid_ms
    scores = ProfileVariance()(told(NR, trials), isi_ms)[0]
    assert 205.0 <= float(isi_ms[scores.argmax()]) <= 265.0


def test_people_are_fitted_apart() -> None:
    posterior = NR.begin(VALVE_SPACE, 1, people=2)
    alone = NR.begin(VALVE_SPACE, 1)
    for isi_ms, mep_mv in trials_of(bell_mv):
        posterior = NR.update(posterior, observation([isi_ms, 500.0 - known(isi_ms)], [mep_mv, mep_mv]))
        alone = NR.update(alone, observation([isi_ms], [mep_mv]))
    assert posterior.estimate(0).window == alone.estimate().window
    mirrored = posterior.estimate(1).window
    assert (known(mirrored).start_ms, known(mirrored).end_ms) == (500.0 - 313.0, 500.0 - 213.0)


def test_a_fantasy_is_what_telling_it_would_have_been() -> None:
    posterior = told(NR, NOISY)
    imagined = posterior.condition(np.array([260.0]), np.array([0.2]))
    real = NR.update(posterior, observation([260.0], [0.2]))
    assert imagined.estimate().window == real.estimate().window
    assert posterior.trials + 1 == imagined.trials


def test_the_segment_of_the_peak_is_reported_or_all_of_them() -> None:
    peak, every = (RegressionModel(TwoHumps(), segments=which).begin(VALVE_SPACE, 0) for which in ("peak", "all"))
    assert known(peak.estimate().window).segments == ((100.0, 200.0),)
    assert len(known(every.estimate().window).segments) == 2
    assert (peak.window_masks(np.array([400.0])) <= every.window_masks(np.array([400.0]))).all()


def test_the_profile_is_that_of_the_mep_and_not_of_its_excess() -> None:
    posterior = told(NR, [(None, 0.03), *trials_of(lambda isi_ms: 0.03 + bell_mv(isi_ms))])
    assert posterior.floors_mv.tolist() == pytest.approx([0.03])
    band = posterior.estimate().profile([263.0, 0.0])
    assert band.median_mv.tolist() == pytest.approx([0.13, 0.03], abs=1e-4)
    low, high = posterior.prediction_mv()
    assert (low[263], high[263]) == pytest.approx((0.13, 0.13), abs=1e-3)


def test_an_estimate_claims_no_probability_and_no_posterior_of_the_edges() -> None:
    estimate = told(NR, NOISY).estimate()
    assert estimate.probability is None
    assert estimate.interval() is None


@pytest.mark.parametrize(("name", "answers_from"), [("nr", 4), ("nr2", 7), ("svmr", 1), ("gpr", 1)])
def test_there_is_no_answer_before_trials_determine_a_curve(name: str, answers_from: int) -> None:
    strategy = make_strategy(name)
    for trial in range(answers_from):
        assert not strategy.estimate().has_answer, trial
        strategy.tell(strategy.ask(), 0.01 + 0.001 * (trial % 3))
    assert strategy.estimate().has_answer


def test_a_response_without_its_amplitude_is_refused() -> None:
    seen = Observation.of([1.0], [None], response=[True])
    with pytest.raises(StrategyError, match="amplitudes only"):
        NR.update(NR.begin(VALVE_SPACE, 0), seen)


def test_an_unknown_word_for_the_segments_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="peak or all"):
        RegressionModel(NonlinearRegression(), segments=cast("Any", "some"))
