"""Stopping rules: when they stop, what they say, and how they compose."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from isiw.decision import StopDecision, StopKind
from isiw.dissertation.strategies import Converging, Passing, Settling
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.decisions import Progress, StoppingRule, looks_back, stimuli_left
from isiw.strategy.stopping import AnyOf, Budget, CredibleWidth, ExpectedF1, NoWindow, SmallGain
from isiw.strategy.strategy import Strategy
from isiw.summary import NO_MEP


def progress(delivered: int = 3, probability: float | None = 0.95, edges_ms: object = None) -> Progress:
    samples = None if edges_ms is None else np.asarray(edges_ms, dtype=float)
    return Progress(delivered, delivered, WindowEstimate(probability, None, edge_samples_ms=samples))


def edges_with_width(width_ms: float) -> list[tuple[float, float]]:
    return [(100 + share * width_ms, 200 + share * width_ms) for share in np.linspace(0, 1, 101)]


@pytest.mark.parametrize(("delivered", "stop"), [(0, False), (4, False), (5, True), (6, True)])
def test_the_budget_counts_delivered_stimuli(delivered: int, *, stop: bool) -> None:
    assert Budget(5)(progress(delivered)).stop == stop


def test_a_mistrial_uses_up_budget_although_it_is_not_told() -> None:
    assert Budget(5)(Progress(delivered=5, told=0, estimate=WindowEstimate(0.5, None))).stop


def test_the_budget_says_how_many_stimuli_are_left() -> None:
    assert Budget(5)(progress(2)).reason == "3 stimuli are left of the budget of 5."


@pytest.mark.parametrize(("width_ms", "stop"), [(20.0, True), (40.0, False)])
def test_narrow_intervals_of_both_edges_stop(width_ms: float, *, stop: bool) -> None:
    assert CredibleWidth(30)(progress(edges_ms=edges_with_width(width_ms))).stop == stop


def test_one_wide_edge_goes_on() -> None:
    edges = [(100 + share, 200 + 50 * share) for share in np.linspace(0, 1, 101)]
    assert not CredibleWidth(30)(progress(edges_ms=edges)).stop


def test_narrow_intervals_of_an_unlikely_window_go_on() -> None:
    assert not CredibleWidth(30)(progress(probability=0.89, edges_ms=edges_with_width(1))).stop
    assert CredibleWidth(30, min_probability=0.8)(progress(probability=0.89, edges_ms=edges_with_width(1))).stop


def test_narrow_intervals_without_a_known_probability_go_on() -> None:
    assert not CredibleWidth(30)(progress(probability=None, edges_ms=edges_with_width(1))).stop


def test_an_edge_beyond_the_range_for_certain_is_known() -> None:
    edges = [(-math.inf, 200 + share) for share in np.linspace(0, 1, 11)]
    assert CredibleWidth(30)(progress(edges_ms=edges)).stop


@pytest.mark.parametrize("start_ms", [[-math.inf, 10.0, 10.0], [-math.inf, -math.inf, 10.0]])
def test_an_edge_that_may_lie_beyond_the_range_has_no_narrow_interval(start_ms: list[float]) -> None:
    decision = CredibleWidth(30)(progress(edges_ms=[(start, 100.0) for start in start_ms]))
    assert not decision.stop
    assert "start still unknown, end known to 0 ms" in decision.reason


@pytest.mark.parametrize(("doubters", "stop"), [(1, True), (2, False), (30, False)])
def test_a_hypothesis_that_is_still_likely_must_agree(doubters: int, *, stop: bool) -> None:
    edges = np.array([(100.0, 200.0)] * (100 - doubters) + [(100.0, 240.0)] * doubters)
    hypotheses = np.where(edges[:, 1] == 240, 2, 0)
    estimate = WindowEstimate(
        0.95, None, edge_samples_ms=edges, hypothesis_samples=hypotheses, hypothesis_names=("a", "b", "c")
    )
    decision = CredibleWidth(30)(Progress(3, 3, estimate))
    assert decision.stop == stop
    assert f"start known to 0 ms, end to {0 if stop else 40} ms (90 % intervals)" in decision.reason


def test_an_f1_that_does_not_end_the_session_never_reads_as_the_one_that_does() -> None:
    nearly, enough = (ExpectedF1(0.92)(expecting(f1, probability=0.95)) for f1 in (0.9199, 0.92))
    assert (nearly.stop, enough.stop) == (False, True)
    assert "so far is at least 0.91; 0.92 ends the session" in nearly.reason
    assert "its expected F1 is at least 0.92." in enough.reason


def test_without_intervals_the_edges_are_not_known() -> None:
    assert not CredibleWidth(30)(progress()).stop


@pytest.mark.parametrize(("probability", "stop"), [(0.05, True), (0.2, False), (None, False)])
def test_no_window_stops_when_it_is_probable_enough(probability: float | None, *, stop: bool) -> None:
    assert NoWindow(0.9)(progress(probability=probability)).stop == stop


@pytest.mark.parametrize(("probability", "said"), [(0.04, "There is no window"), (0.1, "There is probably no window")])
def test_no_window_is_said_outright_from_95_percent_on(probability: float, said: str) -> None:
    assert NoWindow(0.85)(progress(probability=probability)).reason.startswith(f"{said}, with probability")


def expecting(*f1s: float, told: int = 40, probability: float | None = 0.98) -> Progress:
    past = tuple(WindowEstimate(probability, None, expected_f1=f1) for f1 in f1s)
    return Progress(told, told, past[-1], past=past)


@pytest.mark.parametrize(("f1", "probability", "stop"), [(0.9, 0.95, True), (0.89, 0.95, False), (0.95, 0.8, False)])
def test_a_window_that_is_expected_to_be_right_stops(f1: float, probability: float, *, stop: bool) -> None:
    decision = ExpectedF1(0.9)(expecting(f1, probability=probability))
    assert decision.stop == stop
    assert f"is at least {f1:.2f}" in decision.reason


def test_an_expected_f1_of_1_asked_for_never_stops() -> None:
    assert not ExpectedF1(1.0)(expecting(1.0, probability=1.0)).stop


def test_without_an_expected_f1_neither_rule_stops() -> None:
    assert not ExpectedF1(0.0)(progress()).stop
    assert not SmallGain(1.0)(progress(40)).stop


@pytest.mark.parametrize(
    ("first", "told", "probability", "stop"),
    [(0.79, 35, 0.98, True), (0.7, 35, 0.98, False), (0.79, 34, 0.98, False), (0.79, 35, 0.96, False)],
)
def test_stimuli_that_added_little_are_the_last(first: float, told: int, probability: float, *, stop: bool) -> None:
    f1s = np.linspace(first, 0.8, 11).tolist()
    decision = SmallGain(0.02)(expecting(0.1, *f1s, told=told, probability=probability))
    assert decision.stop == stop
    assert f"added {'0.10' if first < 0.75 else 'less than 0.02'} to the expected F1" in decision.reason


@pytest.mark.parametrize(("told", "given", "stop"), [(17, 60, True), (16, 60, False), (26, 30, True), (17, 30, False)])
def test_pulses_over_the_curve_make_up_for_pairs_before_which_a_small_gain_does_not_count(
    told: int, given: int, *, stop: bool
) -> None:
    so_far = expecting(*np.linspace(0.79, 0.8, 11).tolist(), told=told, probability=0.98)
    assert SmallGain(0.02)(replace(so_far, given=given)).stop == stop


def test_a_gain_of_zero_lets_a_session_go_on_also_where_the_expected_f1_falls() -> None:
    falling = expecting(*np.linspace(0.9, 0.8, 11).tolist())
    assert SmallGain(0.001)(falling).stop
    assert "added less than 0.001 to" in SmallGain(0.001)(falling).reason
    assert not SmallGain(0.0)(falling).stop


def test_before_ten_stimuli_nothing_is_known_of_what_ten_add() -> None:
    assert not SmallGain(0.02)(expecting(*[0.8] * 10)).stop
    assert looks_back(AnyOf((SmallGain(), Budget(3)))) == 11


def test_no_window_is_never_concluded_from_data_without_an_mep() -> None:
    nothing = Progress(30, 30, WindowEstimate(0.01, None, silent=True))
    assert NoWindow()(nothing) == StopDecision(stop=False, reason=str(NO_MEP), kind=StopKind.TOO_LITTLE)


@pytest.mark.parametrize("rule", [NoWindow(0.5), ExpectedF1(0.5, 0.0), CredibleWidth(100.0, min_probability=0.0)])
@pytest.mark.parametrize(("pairs", "stop"), [(0, False), (2, False), (3, True), (None, True)])
def test_nothing_is_concluded_from_what_was_believed_beforehand(
    rule: StoppingRule, pairs: int | None, *, stop: bool
) -> None:
    believed = WindowEstimate(0.2, None, edge_samples_ms=np.array(edges_with_width(5.0)), expected_f1=0.9, pairs=pairs)
    decision = rule(Progress(9, 9, believed))
    assert decision.stop == stop
    assert (decision.kind is StopKind.TOO_LITTLE) == (not stop)


def test_any_of_gives_the_reason_of_the_first_rule_that_stops() -> None:
    rule = AnyOf((NoWindow(), Budget(3), Budget(2)))
    assert rule(progress(3)) == Budget(3)(progress(3))


def test_any_of_goes_on_with_all_reasons() -> None:
    rules = (NoWindow(), Budget(9))
    decision = AnyOf(rules)(progress(3))
    assert not decision.stop
    assert all(rule(progress(3)).reason in decision.reason for rule in rules)


def test_what_several_rules_say_is_said_once() -> None:
    few = Progress(2, 2, WindowEstimate(0.5, None, pairs=2, expected_f1=0.5))
    decision = AnyOf((NoWindow(), ExpectedF1(), Budget(9)))(few)
    assert decision.kind is StopKind.TOO_LITTLE


def test_any_of_no_rules_would_never_stop_and_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="at least one rule"):
        AnyOf(())


@pytest.mark.parametrize(
    "decide",
    [
        Budget(1),
        Budget(9),
        CredibleWidth(30),
        CredibleWidth(1),
        NoWindow(0.01),
        NoWindow(),
        Settling(),
        Converging(),
        Passing(),
        AnyOf((Budget(9),)),
    ],
)
@pytest.mark.parametrize("edges_ms", [None, edges_with_width(5)])
def test_every_reason_is_a_full_sentence(decide: Callable[[Progress], StopDecision], edges_ms: Any) -> None:
    reason = decide(progress(edges_ms=edges_ms)).reason
    assert not reason[0].islower()
    assert reason.endswith(".")


@pytest.mark.parametrize("width_ms", [0, -1, math.nan, math.inf])
def test_an_invalid_width_is_refused(width_ms: float) -> None:
    with pytest.raises(InvalidValueError, match="width_ms"):
        CredibleWidth(width_ms)


@pytest.mark.parametrize(("level", "probability"), [(0, 0.9), (1, 0.9), (math.nan, 0.9), (0.9, -0.1), (0.9, 1.1)])
def test_a_level_or_probability_outside_0_to_1_is_refused(level: float, probability: float) -> None:
    with pytest.raises(InvalidValueError, match=r"0 (to|and below) 1|above 0 and of at most 1"):
        CredibleWidth(30, level, probability)


@pytest.mark.parametrize("share", [-0.1, 1.1, math.nan])
def test_a_share_outside_0_to_1_is_refused(share: float) -> None:
    with pytest.raises(InvalidValueError, match=r"0 (to|and below) 1|above 0 and of at most 1"):
        CredibleWidth(30, min_share=share)


@pytest.mark.parametrize("probability", [0, -0.1, 1.1, math.nan])
def test_no_window_needs_a_probability(probability: float) -> None:
    with pytest.raises(InvalidValueError, match=r"0 (to|and below) 1|above 0 and of at most 1"):
        NoWindow(probability)


@pytest.mark.parametrize("max_trials", [0, -1, math.nan, math.inf, 3.0, True])
def test_a_budget_below_1_or_not_whole_is_refused(max_trials: int) -> None:
    with pytest.raises(InvalidValueError, match="whole number of at least 1"):
        Budget(max_trials)


def test_the_smallest_budget_says_how_many_stimuli_are_left() -> None:
    rule = AnyOf((NoWindow(), Budget(9), AnyOf((Budget(7),))))
    assert stimuli_left(rule, 3) == 4
    assert stimuli_left(rule, 8) == 0
    assert stimuli_left(AnyOf((NoWindow(),)), 3) is None
    assert stimuli_left(CredibleWidth(30), 3) is None


class OneInTwo:
    """A rule of a user's own that needs past estimates and sets a budget."""

    looks_back = 4

    def __call__(self, progress: Progress) -> StopDecision:
        return StopDecision(stop=len(progress.past) == self.looks_back, reason="As many as are needed.")

    def stimuli_left(self, delivered: int) -> int:
        return 9 - delivered


def test_a_rule_of_ones_own_says_what_it_needs() -> None:
    for rule in (OneInTwo(), AnyOf((Budget(40), OneInTwo(), Settling(stop_last=3)))):
        assert looks_back(rule) == 4
        assert stimuli_left(rule, 2) == 7
    strategy = make_strategy("nr")
    own = Strategy(strategy.space, strategy.model, strategy.acquisition, stopping=OneInTwo())
    stopped = []
    for trial in range(6):
        own.tell(own.ask(), 0.1 + trial / 1e3)
        stopped.append(own.decision().stop)
    assert stopped == [False, False, False, True, True, True]
