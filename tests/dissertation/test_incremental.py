"""The incremental sweep: what is discarded, where it goes next, and which window it finds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Never

import numpy as np
import pytest

from isiw.acquisition.fixed import IncrementalSweep
from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.dissertation.incremental import SweepModel, SweepPosterior
from isiw.errors import InvalidValueError
from isiw.models.shared.history import FloorTreatment
from isiw.strategy.catalogue import make_strategy
from isiw.testing import check_model
from isiw.trials import Trial
from isiw.window import Window
from known import known
from models.told_trials import bell_mv, observation, told

SPACE = DesignSpace(0.0, 100.0, reference="impact")
BRIEF = SweepModel(step_ms=20.0, trials_per_isi=4, discarded=2, neighbours=1)
BASELINE = [(None, 0.01), (None, 0.02)]


def swept(
    model: SweepModel, means_mv: list[float], startle_mv: float = 0.0, spread_mv: float = 0.001
) -> SweepPosterior:
    """After a sweep of SPACE with these means, the first two trials of each ISI enlarged."""
    trials = []
    for stop, mean_mv in enumerate(means_mv):
        for k in range(model.trials_per_isi):
            startle = startle_mv if k < model.discarded else 0.0
            trials.append((stop * model.step_ms, mean_mv + startle + spread_mv * (-1) ** k))
    posterior: SweepPosterior = told(model, [*BASELINE, *trials], SPACE)
    return posterior


def test_the_first_two_trials_at_each_isi_are_discarded() -> None:
    means_mv = [0.01, 0.01, 0.05, 0.1, 0.01, 0.01]
    startled, calm = (swept(BRIEF, means_mv, startle).estimate() for startle in (1.0, 0.0))
    assert known(startled.profile_quantiles_mv)[1] == pytest.approx(means_mv)
    assert startled.window == calm.window == Window(40.0, 60.0)


def test_ten_of_twelve_are_kept_as_in_the_text() -> None:
    posterior = told(SweepModel(), [(0.0, 1.0)] * 2 + [(0.0, 0.01 * k) for k in range(10)])
    assert posterior.estimate().profile_quantiles_mv[1].tolist() == pytest.approx([0.045])


def test_the_window_is_the_run_about_the_largest_mean_that_exceeds_the_baseline() -> None:
    estimate = swept(BRIEF, [0.03, 0.01, 0.02, 0.1, 0.016, 0.01]).estimate()
    assert estimate.window == Window(40.0, 80.0)


def test_by_the_other_rule_it_is_what_exceeds_0_135_of_the_largest_excess() -> None:
    share = replace(BRIEF, rule="share")
    assert swept(share, [0.03, 0.01, 0.03, 0.1, 0.016, 0.01]).estimate().window == Window(40.0, 60.0)


def test_no_window_is_reported_where_the_largest_mean_is_not_clear_of_the_baseline() -> None:
    means_mv = [0.01, 0.01, 0.02, 0.03, 0.01, 0.01]
    assert swept(BRIEF, means_mv, spread_mv=0.03).estimate().window is None
    assert swept(BRIEF, means_mv, spread_mv=0.001).estimate().window is not None


def test_neighbouring_isis_are_averaged_before_they_are_judged() -> None:
    means_mv = [0.01, 0.06, 0.01, 0.06, 0.061, 0.01]
    assert swept(BRIEF, means_mv).estimate().window == Window(60.0, 80.0)
    together = swept(replace(BRIEF, neighbours=3), means_mv).estimate()
    assert together.window == Window(0.0, 100.0)
    assert known(together.profile_quantiles_mv)[1] == pytest.approx(means_mv)
    # The mean of three has an error of 1/√3 of one's: it is clear where one is not.
    noisy = [0.015, 0.04, 0.04, 0.04, 0.015, 0.015]
    assert swept(BRIEF, noisy, spread_mv=0.012).estimate().window is None
    assert swept(replace(BRIEF, neighbours=3), noisy, spread_mv=0.012).estimate().window is not None


def test_meps_below_the_threshold_may_be_counted_as_none() -> None:
    zeroed = replace(BRIEF, floor=FloorTreatment("zeroed", threshold_mv=0.02))
    assert swept(zeroed, [0.015, 0.015, 0.05, 0.1, 0.015, 0.015]).estimate().window == Window(40.0, 60.0)


def test_without_tms_alone_the_baseline_is_the_median_of_the_means() -> None:
    trials = [(20.0 * stop, mep) for stop, mep in enumerate([0.02, 0.02, 0.1, 0.02, 0.02, 0.02]) for _ in range(4)]
    assert told(BRIEF, trials, SPACE).estimate().window == Window(40.0, 40.0)


def test_what_is_not_swept_yet_is_not_in_the_window() -> None:
    estimate = swept(BRIEF, [0.05, 0.1, 0.2]).estimate()
    assert estimate.window == Window(0.0, 40.0)
    assert known(estimate.grid_ms).tolist() == [0.0, 20.0, 40.0]


def test_a_trial_counts_where_it_was_realised() -> None:
    posterior = told(BRIEF, [(1.0, 0.01), (-1.0, 0.01), (12.0, 0.3), (8.0, 0.1), (12.0, 0.3), (9.0, 0.1)], SPACE)
    assert posterior.estimate().window is None
    posterior = told(BRIEF, [(0.0, 0.0)] * 2 + [(0.0, 0.1), (12.0, 0.3)] + [(20.0, 0.0)] * 2 + [(12.0, 0.5)] * 2, SPACE)
    assert posterior.estimate().grid_ms.tolist() == [20.0]
    assert posterior.estimate().profile_quantiles_mv[1].tolist() == pytest.approx([1.3 / 3])


def test_a_second_sweep_adds_to_the_first() -> None:
    trials = [(20.0 * stop, 0.1 * (1 + again)) for again in range(2) for stop in range(6) for _ in range(4)]
    assert told(BRIEF, trials, SPACE).estimate().profile_quantiles_mv[1].tolist() == pytest.approx([0.15] * 6)


@dataclass(frozen=True)
class Counted:
    """A posterior of which only the number of trials matters."""

    trials: int

    def estimate(self, person: int = 0) -> Never:
        raise AssertionError(person)


def test_it_goes_where_the_incremental_design_goes() -> None:
    plan = SweepModel().begin(VALVE_SPACE, 0).proposed_isis_ms()[0]
    grid = np.arange(0.0, 501.0, 5.0)
    picks = [float(grid[IncrementalSweep()(Counted(trial), grid).argmax()]) for trial in range(1212)]
    assert plan.tolist() == picks


@pytest.mark.parametrize("space", [VALVE_SPACE, IMPACT_SPACE], ids=["valve", "impact"])
def test_a_strategy_steps_by_5_ms_after_twelve_trials_whatever_the_range(space: DesignSpace) -> None:
    strategy = make_strategy("incremental", space)
    asked = []
    for _ in range(30):
        asked.append(strategy.ask())
        strategy.learn(Trial.of(asked[-1], 0.01))
    assert asked == [0.0] * 12 + [5.0] * 12 + [10.0] * 6


def test_in_a_coarser_space_each_of_its_isis_has_twelve_trials() -> None:
    plan = SweepModel().begin(DesignSpace(0, 100, step_ms=10, reference="impact"), 0).proposed_isis_ms()[0].tolist()
    assert plan == [isi_ms for isi_ms in range(0, 101, 10) for _ in range(12)]
    finer = SweepModel().begin(DesignSpace(0, 30, step_ms=2, reference="impact"), 0).proposed_isis_ms()[0].tolist()
    assert finer[::12] == [0.0, 6.0, 12.0, 18.0, 24.0, 30.0]


def test_tms_alone_does_not_move_the_sweep_on() -> None:
    strategy = make_strategy("incremental")
    for _ in range(12):
        strategy.learn(Trial.of(None, 0.01))
    assert strategy.ask_batch(13) == [0.0] * 12 + [5.0]


@pytest.mark.slow
def test_the_sweep_ends_when_it_has_left_the_window_behind() -> None:
    strategy = make_strategy("incremental", seed=0)
    rng = np.random.default_rng(1)
    while not strategy.decision().stop:
        isi_ms = strategy.ask()
        strategy.learn(
            Trial.of(isi_ms, 0.01 * float(np.exp(0.1 * rng.standard_normal())) + float(bell_mv(isi_ms, mean_ms=150.0)))
        )
    assert "passed the window" in strategy.decision().reason
    window = strategy.estimate().window
    # The run reaches as far as means exceed the baseline: somewhat beyond the 100–200 ms of the 0.135 rule.
    assert 70.0 <= known(window).start_ms <= 100.0
    assert 200.0 <= known(window).end_ms <= 230.0


def test_a_sweep_may_be_told_to_go_on_to_the_end() -> None:
    strategy = make_strategy("incremental", quiet_ms=0.0, max_trials=50)
    assert strategy.decision().reason == "50 stimuli are left of the budget of 50."


def test_people_are_swept_side_by_side() -> None:
    posterior = BRIEF.begin(SPACE, 0, people=2)
    posterior = BRIEF.update(posterior, observation([0.0, None], [0.1, 0.1]))
    assert posterior.proposed_isis_ms()[:, 3].tolist() == [20.0, 0.0]


@pytest.mark.parametrize("space", [VALVE_SPACE, IMPACT_SPACE], ids=["valve", "impact"])
def test_the_model_conforms(space: DesignSpace) -> None:
    check_model(lambda: SweepModel(trials_per_isi=3, discarded=1), space, order_tolerance_ms=None)


@pytest.mark.parametrize(
    "settings",
    [
        {"step_ms": 0.0},
        {"discarded": 11},
        {"trials_per_isi": 4.5},
        {"discarded": -1},
        {"rule": "eye"},
        {"evidence_se": -1.0},
        {"neighbours": 2},
    ],
)
def test_an_invalid_setting_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=r"step_ms|trials_per_isi|discarded|rule|evidence_se|neighbours"):
        SweepModel(**settings)
