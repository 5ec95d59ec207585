from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from isiw.decision import StopDecision
from isiw.errors import ConfigError, InvalidValueError, LimitExceededError
from isiw.strategy.threshold import (
    IntensityRange,
    Pulse,
    ThresholdEstimate,
    ThresholdSearch,
    list_threshold_methods,
    make_threshold_search,
)

SPACE = IntensityRange(30, 70)
METHODS = [method for method in list_threshold_methods() if method != "curve"]  # which asks what an operator names


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("answer", "advice"), [(True, "begins at 30 % MSO"), (False, "ends at 70 % MSO")])
def test_answers_of_one_kind_never_give_a_number(*, method: str, answer: bool, advice: str) -> None:
    search = make_threshold_search(method, SPACE)
    while not search.decision().stop:
        assert search.estimate().threshold_pct_mso is None
        search.tell(search.ask(), response=answer)
        assert len(search.pulses) < 60
    assert search.estimate().threshold_pct_mso is None
    assert advice in search.estimate().reason


def test_before_the_first_pulse_there_is_no_number() -> None:
    search = make_threshold_search("bayes", SPACE)
    assert str(search.estimate()) == "No threshold can be stated. No pulse has an outcome yet."
    assert not search.decision().stop


def test_what_is_asked_stays_until_something_is_told() -> None:
    search = make_threshold_search("bayes", SPACE)
    asked = search.ask()
    assert search.ask() == asked
    search.tell(asked, 0.01)
    assert search.ask() > asked


def ended(search: ThresholdSearch, amplitude: Callable[[], float]) -> ThresholdSearch:
    """The search, ended with amplitudes that do not depend on the intensity."""
    while not search.decision().stop:
        search.tell(search.ask(), amplitude())
        assert len(search.pulses) <= 40
    return search


def test_hum_at_one_intensity_gives_no_number_and_ends_with_the_budget() -> None:
    rng = np.random.default_rng(2)
    search = ended(make_threshold_search("bayes", IntensityRange(20, 80)), lambda: 0.05 * math.exp(rng.normal(0, 0.1)))
    assert {pulse.intensity_pct_mso for pulse in search.pulses} == {55}
    assert {pulse.responded for pulse in search.pulses} == {True, False}
    assert search.estimate().threshold_pct_mso is None
    assert search.estimate().reason == search.decision().reason
    assert "At 55 % MSO some pulses evoked an MEP and some did not" in search.decision().reason
    assert "budget of 40 pulses is used up" in search.decision().reason
    assert "hum or an artefact" in search.decision().reason


@pytest.mark.slow
@pytest.mark.parametrize("method", ["bayes", "maximum-likelihood", "five-of-ten"])
def test_hum_that_answers_at_several_intensities_gives_no_number(method: str) -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        search = make_threshold_search(method, IntensityRange(20, 80))
        while not search.decision().stop:
            search.tell(search.ask(), 0.05 * math.exp(rng.normal(0, 0.05)))
        assert search.estimate().threshold_pct_mso is None


def test_answered_pulses_must_be_larger_than_the_others() -> None:
    search = make_threshold_search("five-of-ten", SPACE)
    for _ in range(6):
        search.tell(44, 0.04)
        search.tell(45, 0.059)
    assert search.estimate().threshold_pct_mso is None
    assert "(median 59 µV) are only a little larger than the others (median 40 µV)" in search.decision().reason
    assert "hum or an artefact" in search.decision().reason
    for _ in range(7):
        search.tell(45, 0.07)
    assert search.estimate().threshold_pct_mso == 45


@pytest.mark.parametrize("mep_mv", [0.048, 0.05, 0.06])
def test_answers_of_one_kind_end_with_the_budget(mep_mv: float) -> None:
    search = ended(make_threshold_search("bayes", IntensityRange(20, 80)), lambda: mep_mv)
    assert len(search.pulses) == 40
    assert search.estimate().threshold_pct_mso is None
    assert "budget of 40 pulses is used up" in search.decision().reason


def test_the_budget_of_maximum_likelihood_holds_where_nothing_was_answered_yet() -> None:
    search = ended(make_threshold_search("maximum-likelihood", SPACE, pulses=3), lambda: 0.01)
    assert len(search.pulses) == 3
    assert "No pulse evoked an MEP, up to " in search.decision().reason


@pytest.mark.parametrize("method", ["bayes", "maximum-likelihood"])
@pytest.mark.parametrize(
    ("missed", "answered", "number"), [(50, 50, False), (50, 45, False), (45, 50, True), (50, 51, True)]
)
def test_a_number_needs_an_answer_above_an_intensity_without_one(
    *, method: str, missed: float, answered: float, number: bool
) -> None:
    search = make_threshold_search(method, SPACE)
    for _ in range(6):
        search.tell(missed, 0.01)
        search.tell(answered, 0.2)
    assert (search.estimate().threshold_pct_mso is not None) == number


def test_a_mixture_at_the_end_of_the_range_still_ends_the_search() -> None:
    low = make_threshold_search("five-of-ten", IntensityRange(40, 80))
    for number in range(9):
        low.tell(40, response=number % 2 == 0)
    assert low.decision().stop
    assert "begin a new search lower" in low.decision().reason
    high = make_threshold_search("bayes", IntensityRange(20, 40))
    for number in range(10):
        high.tell(40, response=number == 5)
    assert high.decision().stop
    assert "above the highest intensity" in high.decision().reason


def test_a_first_amplitude_in_volts_is_refused_and_a_quiet_sweep_later_is_not() -> None:
    search = make_threshold_search("bayes", SPACE)
    search.tell(50, 0.0)
    with pytest.raises(InvalidValueError, match=r"Is it in V\? Multiply by 1000"):
        search.tell(50, 0.0013)
    assert len(search.pulses) == 1
    search.tell(50, 0.008)
    search.tell(50, 0.0013)
    assert len(search.pulses) == 3


@pytest.mark.parametrize(
    ("mep_mv", "complaint"),
    [(math.nan, "finite"), (-0.1, "least 0"), (80.0, "µV"), (8e-5, "in V"), (math.inf, "finite")],
)
def test_an_amplitude_that_cannot_be_is_refused_and_nothing_is_learnt(mep_mv: float, complaint: str) -> None:
    search = make_threshold_search("bayes", SPACE)
    with pytest.raises(InvalidValueError, match=complaint):
        search.tell(50, mep_mv)
    assert search.pulses == ()


@pytest.mark.parametrize("intensity", [29.0, 71.0, 50.3])
def test_an_intensity_off_the_grid_is_refused(intensity: float) -> None:
    with pytest.raises(LimitExceededError):
        make_threshold_search("bayes", SPACE).tell(intensity, 0.1)


class Greedy:
    """Asks for more than is allowed."""

    def ask(self, pulses: Sequence[Pulse], space: IntensityRange) -> float:
        return space.high_pct_mso + len(pulses) + 1

    def estimate(self, pulses: Sequence[Pulse], space: IntensityRange) -> ThresholdEstimate:
        return ThresholdEstimate(space.low_pct_mso + len(pulses))

    def decision(self, pulses: Sequence[Pulse], space: IntensityRange) -> StopDecision:
        return StopDecision(len(pulses) > space.high_pct_mso, "")


def test_a_method_that_asks_for_more_than_the_limit_is_stopped() -> None:
    with pytest.raises(LimitExceededError, match="beyond the limits"):
        ThresholdSearch("greedy", Greedy(), SPACE).ask()


def test_unknown_methods_and_settings_are_refused() -> None:
    with pytest.raises(InvalidValueError, match="maximum-likelihood"):
        make_threshold_search("best", SPACE)
    with pytest.raises(ConfigError, match="stop_sd"):
        make_threshold_search("bayes", SPACE, stop_sd=1.0)


@pytest.mark.parametrize("method", METHODS)
def test_a_search_is_made_again_from_its_settings(method: str) -> None:
    search = make_threshold_search(method, SPACE)
    assert make_threshold_search(method, SPACE, **search.settings).method == search.method
