from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from isiw.errors import ConfigError, InvalidValueError, LimitExceededError
from isiw.strategy.stopping import StopDecision
from isiw.strategy.threshold import (
    IntensityRange,
    Pulse,
    ThresholdEstimate,
    ThresholdSearch,
    list_threshold_methods,
    make_threshold_search,
)

SPACE = IntensityRange(30, 70)
METHODS = list(list_threshold_methods())


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("answer", "advice"), [(True, "begins too high, at 30 %"), (False, "ends too low, at 70 %")])
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
    assert str(search.estimate()) == "No resting motor threshold. Nothing was told yet."
    assert not search.decision().stop


def test_what_is_asked_stays_until_something_is_told() -> None:
    search = make_threshold_search("bayes", SPACE)
    asked = search.ask()
    assert search.ask() == asked
    search.tell(asked, 0.01)
    assert search.ask() > asked


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
    with pytest.raises(InvalidValueError, match="bayes or maximum-likelihood or five-of-ten"):
        make_threshold_search("best", SPACE)
    with pytest.raises(ConfigError, match="stop_sd"):
        make_threshold_search("bayes", SPACE, stop_sd=1.0)


@pytest.mark.parametrize("method", METHODS)
def test_a_search_is_made_again_from_its_settings(method: str) -> None:
    search = make_threshold_search(method, SPACE)
    assert make_threshold_search(method, SPACE, **search.settings).method == search.method
