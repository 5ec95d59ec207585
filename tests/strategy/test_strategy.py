"""The strategy: what it asks, what it refuses to be told, and how it starts again."""

from __future__ import annotations

import inspect
import itertools
import math
import sys
import warnings
from dataclasses import dataclass
from types import FrameType
from typing import Any, cast

import numpy as np
import pytest

from isiw.acquisition.fixed import IncrementalSweep
from isiw.acquisition.information import MutualInformation, WindowGain
from isiw.decision import StopDecision
from isiw.design import VALVE_SPACE, DesignSpace
from isiw.dissertation.strategies import Settling
from isiw.errors import InvalidValueError, OutOfSpaceError, StrategyError
from isiw.findings import Kind
from isiw.models.protocol import Posterior
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.decisions import Progress
from isiw.strategy.recipe import Recipe
from isiw.strategy.stopping import Budget
from isiw.strategy.strategy import Strategy
from isiw.testing.suites import same_estimates
from isiw.trials import Status, Trial
from isiw.types import Array
from known import known
from scripted import scripted_strategy

MEPS_MV = [0.02, 0.0, 0.11, 0.05]


class Least:
    """A rule that says what it is told of progress."""

    def __call__(self, progress: Progress) -> StopDecision:
        return StopDecision(stop=False, reason=f"{progress.delivered} of {progress.told}, {progress.given} given")


def play(strategy: Strategy, meps_mv: list[float]) -> list[float]:
    """The ISIs asked for while these amplitudes are told, and the next one."""
    asks = []
    for mep_mv in meps_mv:
        asks.append(strategy.ask())
        strategy.tell(asks[-1], mep_mv)
    return [*asks, strategy.ask()]


@pytest.fixture
def particles() -> Strategy:
    """The default strategy, with few particles."""
    return make_strategy(particles=64, seed=3)


@dataclass(frozen=True)
class Scores:
    """An acquisition function that gives the same scores whatever the posterior."""

    values: Array
    needs: tuple[type, ...] = ()

    def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
        del posterior, isi_ms
        return self.values[None]


def test_ask_is_the_same_until_the_next_tell() -> None:
    strategy = scripted_strategy()
    first = strategy.ask()
    assert [strategy.ask() for _ in range(3)] == [first] * 3
    strategy.tell(first, 0.07)
    assert strategy.ask() != first


def test_every_ask_is_on_the_grid(particles: Strategy) -> None:
    assert set(play(particles, MEPS_MV)) <= set(VALVE_SPACE.grid_ms)


def test_the_same_seed_and_tells_give_the_same_asks() -> None:
    runs = [play(make_strategy(particles=64, seed=seed), MEPS_MV) for seed in (3, 3, 4)]
    assert runs[0] == runs[1] != runs[2]


def test_other_tells_give_other_asks() -> None:
    assert play(scripted_strategy(), [0.02, 0.05]) != play(scripted_strategy(), [0.02, 0.06])


def test_asking_for_estimates_and_decisions_leaves_the_asks_alone() -> None:
    quiet, watched = (make_strategy(particles=64, seed=3) for _ in range(2))
    expected = play(quiet, MEPS_MV)
    asks = []
    for mep_mv in MEPS_MV:
        watched.estimate()
        asks.append(watched.ask())
        watched.decision()
        watched.tell(asks[-1], mep_mv)
    assert [*asks, watched.ask()] == expected


def test_a_restarted_strategy_replays_identically(particles: Strategy) -> None:
    first = play(particles, MEPS_MV)
    again = particles.restarted()
    assert again.posterior.trials == 0
    assert play(again, MEPS_MV) == first
    np.testing.assert_array_equal(again.estimate().profile_quantiles_mv, particles.estimate().profile_quantiles_mv)
    assert particles.posterior.trials == len(MEPS_MV)


def test_a_restarted_strategy_keeps_its_recipe_and_forgets_its_mistrials() -> None:
    strategy = scripted_strategy(max_trials=1)
    strategy.count_mistrial()
    again = strategy.restarted()
    assert again.recipe == strategy.recipe == Recipe(name="", seed=0)
    assert (strategy.decision().stop, again.decision().stop) == (True, False)


def test_a_strategy_is_printed_with_what_it_is_made_of_and_what_it_knows() -> None:
    strategy = make_strategy("even", particles=64, seed=3)
    strategy.tell(250.0, 0.1)
    strategy.count_mistrial()
    assert str(strategy).splitlines() == [
        "Strategy 'even', seed 3",
        "Space: 0–500 ms after the valve command, every 1 ms",
        "Model: ParticleModel, ISIs chosen by EvenSpacing",
        "Trials: 1 learnt, 1 mistrials",
    ]
    assert str(scripted_strategy()).startswith("Strategy, seed 0\n")


REFUSED = [
    ({"isi_ms": 250.0, "mep_mv": math.nan}, InvalidValueError, "mep_mv"),
    ({"isi_ms": -math.inf, "mep_mv": 0.1}, InvalidValueError, "realised ISI"),
    ({"isi_ms": 510.5, "mep_mv": 0.1}, OutOfSpaceError, "beyond the design space"),
    ({"isi_ms": -10.5, "mep_mv": 0.1}, OutOfSpaceError, "beyond the design space"),
    ({"isi_ms": 250.0}, InvalidValueError, "needs one of mep_mv"),
    ({"isi_ms": 250.0, "mep_mv": 0.1, "response": True}, InvalidValueError, "needs one of mep_mv"),
    ({"isi_ms": 250.0, "response": math.nan}, InvalidValueError, "True or False"),
    ({"isi_ms": 250.0, "mep_mv": 0.1, "isi_sd_ms": -1.0}, InvalidValueError, "isi_sd_ms"),
]


@pytest.mark.parametrize(("told", "error", "what"), REFUSED)
def test_invalid_values_are_refused_and_change_nothing(
    told: dict[str, Any], error: type[Exception], what: str, particles: Strategy
) -> None:
    play(particles, [0.05])
    before, estimate = (particles.ask(), particles.posterior, particles.decision()), particles.estimate()
    with pytest.raises(error, match=what):
        particles.tell(**told)
    assert (particles.ask(), particles.posterior, particles.decision()) == before
    assert same_estimates(particles.estimate(), estimate)


def test_a_model_that_fails_leaves_the_strategy_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    strategy = scripted_strategy()
    isi_ms, posterior = strategy.ask(), strategy.posterior

    def fail(*_: object) -> None:
        raise RuntimeError("singular")

    with monkeypatch.context() as patch:
        patch.setattr(type(strategy.model), "update", fail)
        with pytest.raises(RuntimeError, match="singular"):
            strategy.tell(isi_ms, 0.1)
    assert strategy.posterior is posterior
    assert strategy.decision().reason == "6 stimuli are left of the budget of 6."
    assert strategy.ask() == isi_ms


@pytest.mark.parametrize(
    "told",
    [
        {"isi_ms": None, "mep_mv": 0.02},
        {"isi_ms": 250.0, "mep_mv": 0.0},
        {"isi_ms": 250.0, "response": True},
        {"isi_ms": None, "response": False},
        {"isi_ms": 247.3, "mep_mv": 0.05, "isi_sd_ms": 3.0},
        {"isi_ms": 510.0, "mep_mv": 0.05},
        {"isi_ms": -10.0, "mep_mv": 0.05},
    ],
)
def test_every_legitimate_trial_is_learnt_from(told: dict[str, Any], particles: Strategy) -> None:
    untold = known(particles.estimate().profile_quantiles_mv)
    particles.tell(**told)
    learnt = known(particles.estimate().profile_quantiles_mv)
    assert particles.posterior.trials == 1
    assert np.isfinite(learnt).all()
    assert not np.array_equal(learnt, untold)
    assert particles.ask() in VALVE_SPACE.grid_ms


def test_a_response_that_was_seen_raises_the_expected_mep_above_one_that_was_not(particles: Strategy) -> None:
    unseen = particles.restarted()
    for isi_ms in (240.0, 260.0, 280.0):
        particles.tell(isi_ms, response=True)
        unseen.tell(isi_ms, response=False)
    seen_mv, unseen_mv = (known(s.estimate().profile([260.0])).median_mv[0] for s in (particles, unseen))
    assert seen_mv > 1.5 * unseen_mv


def test_a_mistrial_moves_the_budget_and_nothing_else(particles: Strategy) -> None:
    play(particles, [0.05])
    before, estimate = (particles.ask(), particles.posterior), particles.estimate()
    reason = particles.decision().reason
    particles.count_mistrial()
    assert (particles.ask(), particles.posterior) == before
    assert same_estimates(particles.estimate(), estimate)
    assert "59 stimuli are left" in reason
    assert particles.decision().reason == reason.replace("59 stimuli", "58 stimuli")


def test_pairs_and_mistrials_use_up_one_budget_and_control_trials_none() -> None:
    strategy = scripted_strategy(max_trials=3)
    strategy.tell(strategy.ask(), 0.1)
    strategy.count_mistrial()
    assert not strategy.decision().stop
    strategy.tell(None, 0.1)
    strategy.tell(100.0, 0.1, pulse=False)
    assert (strategy.delivered, strategy.spent) == (4, 2)
    assert not strategy.decision().stop
    strategy.tell(strategy.ask(), 0.1)
    assert strategy.decision().stop


@pytest.mark.parametrize("acquisition", [WindowGain(), MutualInformation()])
def test_an_acquisition_function_that_the_model_cannot_serve_is_refused_with_the_reason(
    acquisition: WindowGain | MutualInformation,
) -> None:
    model = scripted_strategy().model
    with pytest.raises(StrategyError, match="cannot work with RememberingModel") as caught:
        Strategy(VALVE_SPACE, model, acquisition, Budget(3))
    assert all(need.__name__ in str(caught.value) for need in acquisition.needs)


class WithoutNeeds:
    """Scores, and does not say what of a posterior it uses."""

    def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
        del posterior
        return isi_ms


@pytest.mark.parametrize(
    ("acquisition", "message"),
    [
        (MutualInformation, r"not its class; got <class .*MutualInformation'>. Make one: MutualInformation\(\)"),
        (WithoutNeeds(), r"cannot be an acquisition function.*Give its class `needs`"),
        (
            Scores(np.zeros(5), needs=cast("Any", WithoutNeeds)),
            r"cannot be an acquisition function.*Give its class `needs`",
        ),
        ("thompson", r"cannot be an acquisition function; got 'thompson'"),
    ],
)
def test_what_is_no_acquisition_function_is_told_with_the_way_out(acquisition: Any, message: str) -> None:
    usual = scripted_strategy()
    with pytest.raises(StrategyError, match=message):
        Strategy(usual.space, usual.model, acquisition, usual.stopping)


def test_the_class_of_a_model_is_none() -> None:
    usual = scripted_strategy()
    kind: Any = type(usual.model)
    with pytest.raises(StrategyError, match=rf"model is needed, and not its class.*Make one: {kind.__name__}\(\)"):
        Strategy(usual.space, kind, usual.acquisition, usual.stopping)


@pytest.mark.parametrize("seed", [-1, 1.5])
def test_a_seed_is_a_whole_number_also_of_a_strategy_of_ones_own(seed: Any) -> None:
    usual = scripted_strategy()
    with pytest.raises(InvalidValueError, match="the seed"):
        Strategy(usual.space, usual.model, usual.acquisition, usual.stopping, seed=seed)


def test_a_stopping_rule_that_answers_with_something_else_is_refused_with_the_way_out() -> None:
    usual = make_strategy(particles=50)
    strategy = Strategy(usual.space, usual.model, usual.acquisition, lambda _: (True, "Enough."))  # type: ignore[arg-type]
    with pytest.raises(StrategyError, match=r"isiw\.StopDecision\(stop, reason\)"):
        strategy.decision()


def test_a_tie_is_asked_at_the_first_isi_and_a_score_that_is_not_finite_never() -> None:
    model = scripted_strategy().model
    space = DesignSpace(0, 4, reference="impact")
    tie = Scores(np.array([math.inf, 0.0, math.nan, 2.0, 2.0]))
    assert Strategy(space, model, tie, Budget(3)).ask() == 3.0


def test_where_no_score_is_finite_the_isi_is_evenly_spaced_and_says_why() -> None:
    nothing = Scores(np.full(5, math.nan))
    strategy = Strategy(DesignSpace(0, 4, reference="impact"), scripted_strategy().model, nothing, Budget(3))
    asked = []
    for _ in range(3):
        asked.append(strategy.ask())
        assert "Scores gives no ISI a finite score" in (strategy.fallback_reason or "")
        strategy.tell(asked[-1], 0.02)
    assert len(set(asked)) == 3


def test_the_initial_isis_come_first_and_a_mistrial_repeats_one() -> None:
    usual = scripted_strategy()
    strategy = Strategy(usual.space, usual.model, usual.acquisition, usual.stopping, initial_ms=(0.0, 120.2, 200.0))
    assert strategy.ask() == 0.0
    strategy.count_mistrial()
    assert strategy.ask() == 0.0
    strategy.tell(1.0, 0.02)
    strategy.tell(None, 0.02)
    assert strategy.ask() == 120.0
    assert strategy.restarted().ask() == 0.0


def settled_after(strategy: Strategy, trials: int) -> bool:
    """Whether the edges have settled after so many more pairs, each of which moves them by 1 ms."""
    for _ in range(trials):
        strategy.learn(Trial.of(strategy.ask(), 0.02))
    return strategy.decision().stop


def test_only_windows_after_the_initial_isis_tell_whether_the_edges_have_settled() -> None:
    usual = scripted_strategy()
    for initial_ms in ((), (0.0,), (0.0, 100.0, 200.0)):
        strategy = Strategy(usual.space, usual.model, usual.acquisition, Settling(), initial_ms=initial_ms)
        # The value after the last initial trial is the first.
        assert not settled_after(strategy, max(1, len(initial_ms)) + 3)
        assert settled_after(strategy, 1)


def test_tms_alone_does_not_settle_the_edges() -> None:
    usual = scripted_strategy()
    strategy = Strategy(usual.space, usual.model, usual.acquisition, Settling())
    settled_after(strategy, 4)
    for _ in range(5):
        strategy.learn(Trial.of(None, 0.02))
        assert not strategy.decision().stop
    assert settled_after(strategy, 1)


def test_tms_alone_is_none_of_the_forty_pairs_from_which_on_a_small_gain_stops() -> None:
    usual = scripted_strategy()
    strategy = Strategy(usual.space, usual.model, usual.acquisition, Least())
    for _ in range(5):
        strategy.learn(Trial.of(None, 0.02))
    strategy.learn(Trial.of(100.0, 0.02))
    assert strategy.decision().reason == "1 of 1, 0 given"


def test_pulses_of_a_stated_intensity_before_the_first_pair_are_counted_as_given() -> None:
    usual = make_strategy("default", particles=100)
    strategy = Strategy(usual.space, usual.model, usual.acquisition, Least())
    strategy.tell(None, 0.02)  # of the session's own intensity
    for pct_rmt in (110, 120):
        strategy.tell(None, 0.4, intensity_pct_rmt=pct_rmt)
    strategy.tell(strategy.ask(), 0.3)
    strategy.tell(None, 0.4, intensity_pct_rmt=110)
    assert strategy.decision().reason == "1 of 1, 2 given"


def test_a_model_without_a_law_of_other_intensities_was_given_nothing() -> None:
    usual = make_strategy("gp-variance")
    strategy = Strategy(usual.space, usual.model, usual.acquisition, Least())
    strategy.tell(None, 0.4, intensity_pct_rmt=120)
    assert strategy.decision().reason == "0 of 0, 0 given"


def test_a_design_goes_on_with_its_plan_however_often_a_trial_is_lost() -> None:
    usual = scripted_strategy()
    strategy = Strategy(usual.space, usual.model, IncrementalSweep(), usual.stopping)
    planned_ms = strategy.ask()
    for _ in range(5):
        strategy.count_mistrial()
    assert strategy.ask() == planned_ms


def test_a_cost_is_taken_off_the_scores() -> None:
    level = Scores(np.array([1.0, 2.0, 3.0, 4.0, 5.0]))
    model = scripted_strategy().model
    assert Strategy(DesignSpace(0, 4, reference="impact"), model, level, Budget(3)).ask() == 4.0
    assert (
        Strategy(DesignSpace(0, 4, reference="impact"), model, level, Budget(3), cost=lambda isi_ms: 2 * isi_ms).ask()
        == 0.0
    )


def test_a_batch_begins_with_what_is_asked_and_repeats_no_isi_that_has_been_learnt() -> None:
    strategy = make_strategy("particles-window", particles=500)
    for isi_ms, mep_mv in ((100.0, 0.01), (250.0, 0.2), (400.0, 0.01)):
        strategy.tell(isi_ms, mep_mv)
    batch = strategy.ask_batch(4)
    assert batch[0] == strategy.ask()
    assert batch == strategy.ask_batch(4)
    assert len(set(batch)) == 4


def test_a_batch_says_why_one_of_its_isis_is_not_the_acquisition_functions_choice() -> None:
    model = make_strategy("default", particles=50).model
    first = Strategy(
        DesignSpace(0, 4, reference="impact"), model, Scores(np.full(5, math.nan)), Budget(3), initial_ms=(2.0,)
    )
    assert first.ask_batch(1) == [2.0]
    assert first.fallback_reason is None
    assert len(first.ask_batch(2)) == 2
    assert "no ISI a finite score" in (first.fallback_reason or "")


def test_a_batch_takes_up_the_initial_isis_first() -> None:
    usual = scripted_strategy()
    strategy = Strategy(usual.space, usual.model, usual.acquisition, usual.stopping, initial_ms=(0.0, 100.0, 200.0))
    assert strategy.ask_batch(3) == [0.0, 100.0, 200.0]
    assert strategy.ask_batch(2) == [0.0, 100.0]


def test_a_batch_of_a_sweep_goes_on_with_it_whatever_the_model() -> None:
    usual = scripted_strategy()
    sweep = IncrementalSweep(step_ms=5.0, trials_per_isi=2)
    strategy = Strategy(usual.space, usual.model, sweep, usual.stopping, initial_ms=(200.0,))
    assert strategy.ask_batch(6) == [200.0, 0.0, 5.0, 5.0, 10.0, 10.0]
    strategy.learn(Trial.of(200.0, 0.02))
    strategy.learn(Trial.of(None, 0.02))
    assert strategy.ask_batch(2) == [0.0, 5.0]


def test_a_batch_from_a_model_that_imagines_no_trials_is_refused() -> None:
    with pytest.raises(StrategyError, match="cannot imagine trials"):
        scripted_strategy().ask_batch(2)
    assert len(scripted_strategy().ask_batch(1)) == 1
    for number in (0, 10**9):
        with pytest.raises(InvalidValueError, match="from 1 to 1000"):
            scripted_strategy().ask_batch(number)


def test_a_slip_that_is_refused_changes_nothing() -> None:
    strategy = scripted_strategy()
    isi_ms = strategy.ask()
    for told in ((isi_ms / 1000, 0.02), (0.02, isi_ms), (isi_ms, 1e-6), (isi_ms, 1e12)):
        with pytest.raises(InvalidValueError):
            strategy.tell(*told)
    assert strategy.ask() == isi_ms
    assert strategy.delivered == 0


def test_an_isi_far_from_the_one_asked_is_told_with_one_warning() -> None:
    strategy = scripted_strategy()
    said = []
    for _ in range(2):
        far_ms = 0.0 if strategy.ask() > 100 else 200.0
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            strategy.tell(far_ms, 0.02)
        said.append(len(caught))
    assert said == [1, 0]
    assert strategy.delivered == 2


def test_pulses_that_give_no_mep_any_more_are_told_with_one_warning() -> None:
    strategy, said = scripted_strategy(), []
    for mep_mv in [0.1, 0.2] * 4 + [0.0] * 12:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            strategy.tell(100.0, mep_mv)
        said += [str(warning.message) for warning in caught if "earlier ones did" in str(warning.message)]
    assert len(said) == 1


def test_what_was_judged_before_is_learnt_as_it_is() -> None:
    strategy = scripted_strategy()
    strategy.ask()
    strategy.learn(Trial.of(100.0, 50.0))
    assert strategy.delivered == 1


def warnings_of(strategy: Strategy, *isis_ms: float | None) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for number, isi_ms in enumerate(isis_ms):
            strategy.tell(isi_ms, 0.02 + 0.01 * number)
    return [str(warning.message) for warning in caught]


def a_batch() -> tuple[Strategy, list[float]]:
    usual = scripted_strategy()
    strategy = Strategy(usual.space, usual.model, usual.acquisition, usual.stopping, initial_ms=(20, 100, 180))
    return strategy, strategy.ask_batch(3)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_a_batch_is_told_in_any_order_without_a_warning(order: tuple[int, ...]) -> None:
    strategy, batch = a_batch()
    assert warnings_of(strategy, None, *(batch[index] + 3.0 for index in order)) == []
    assert strategy.delivered == 4


def test_an_isi_of_a_batch_that_is_told_twice_is_odd() -> None:
    strategy, batch = a_batch()
    (said,) = warnings_of(strategy, batch[0], batch[0])
    assert f"{batch[0]:g} ms is far from the {batch[1]:g} ms" in said


def test_what_is_asked_after_a_batch_takes_its_place(particles: Strategy) -> None:
    batch = particles.ask_batch(3)
    particles.tell(batch[2], 0.05)
    since_ms = particles.ask()
    assert min(abs(since_ms - isi_ms) for isi_ms in batch) > VALVE_SPACE.tolerance_ms
    assert warnings_of(particles, since_ms) == []
    assert abs(particles.ask() - batch[0]) > VALVE_SPACE.tolerance_ms
    assert len(warnings_of(particles, batch[0])) == 1


@pytest.mark.parametrize(("told", "slip"), [((0.1, 0.02), "in seconds"), ((0.02, 180.0), "swapped")])
def test_a_slip_with_any_isi_of_a_batch_is_refused(told: tuple[float, float], slip: str) -> None:
    strategy, batch = a_batch()
    with pytest.raises(InvalidValueError, match=slip):
        strategy.tell(*told)
    assert strategy.delivered == 0
    assert warnings_of(strategy, *batch) == []


def test_a_batch_begins_with_what_is_asked_also_where_trials_were_lost() -> None:
    strategy = make_strategy("nr")
    strategy.ask()
    for _ in range(3):
        strategy.count_mistrial()
    assert strategy.ask_batch(2)[0] == strategy.ask()


def interrupted_at(call: int, strategy: Strategy, trial: Trial) -> bool:
    """Whether learning a trial was interrupted, at the entry into a function or behind one, as by Ctrl-C."""
    left = itertools.count(call, -1)

    def look(frame: FrameType, event: str, _: object) -> None:
        # A generator that is thrown away says of an error in it that it is ignored.
        if event in {"call", "c_return"} and not frame.f_code.co_flags & inspect.CO_GENERATOR and next(left) == 0:
            sys.setprofile(None)
            raise KeyboardInterrupt

    before = sys.getprofile()
    sys.setprofile(look)
    try:
        strategy.learn(trial)
    except KeyboardInterrupt:
        return True
    finally:
        sys.setprofile(before)
    return False


LOST = Trial(9, Status.MISTRIAL, 50.0, Kind.OUTCOME_UNKNOWN)


@pytest.mark.parametrize(
    "trial",
    [Trial.of(50.0, 0.3), Trial.of(None, 0.1), Trial(9, Status.ACCEPTED, None, mep_mv=0.1, tap_alone=True), LOST],
)
def test_a_trial_is_learnt_wholly_or_not_at_all_wherever_ctrl_c_comes(trial: Trial) -> None:
    def told() -> Strategy:
        strategy = scripted_strategy(20)
        for before in (Trial.of(80.0, 0.2), LOST, LOST):
            strategy.ask()
            strategy.learn(before)
        return strategy

    once = told()
    once.learn(trial)
    for call in itertools.count():
        strategy = told()
        interrupted = interrupted_at(call, strategy, trial)
        if strategy.delivered < once.delivered:
            strategy.learn(trial)
        assert vars(strategy)["_outcomes"] == vars(once)["_outcomes"]
        assert (strategy.ask(), strategy.spent) == (once.ask(), once.spent)
        if not interrupted:
            break
    assert call > 5
