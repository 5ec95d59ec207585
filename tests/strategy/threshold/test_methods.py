"""What each method does with answers that are known."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from isiw.errors import InvalidValueError
from isiw.strategy.threshold import (
    BayesThreshold,
    FiveOfTen,
    IntensityRange,
    MaximumLikelihood,
    Pulse,
    ThresholdSearch,
    make_threshold_search,
)
from isiw.strategy.threshold.bayes import THRESHOLDS_PCT_MSO
from isiw.subjects.thresholds import threshold_cohort

SPACE = IntensityRange(20, 100)


def run(search: ThresholdSearch, answer: Callable[[float], bool], most: int = 150) -> ThresholdSearch:
    while not search.decision().stop and len(search.pulses) < most:
        intensity = search.ask()
        search.tell(intensity, response=answer(intensity))
    return search


@pytest.mark.parametrize(("method", "tolerance"), [("bayes", 2.0), ("maximum-likelihood", 1.5), ("five-of-ten", 0.5)])
@pytest.mark.parametrize("threshold", [31.5, 47.5, 78.5])
def test_without_noise_every_method_finds_the_threshold(method: str, tolerance: float, threshold: float) -> None:
    search = run(make_threshold_search(method, SPACE), lambda intensity: intensity >= threshold)
    assert search.decision().stop
    assert search.estimate().threshold_pct_mso == pytest.approx(threshold, abs=tolerance)


def test_five_of_ten_goes_up_in_large_steps_and_down_in_small_ones() -> None:
    search = run(make_threshold_search("five-of-ten", SPACE), lambda intensity: intensity >= 47.5)
    asked = [search.pulses[0].intensity_pct_mso]
    asked += [b.intensity_pct_mso for a, b in pairwise(search.pulses) if a.intensity_pct_mso != b.intensity_pct_mso]
    assert asked == [40, 45, 50, 49, 48, 47]
    assert len(search.pulses) == 6 + 6 + 5 + 5 + 5 + 6
    assert search.estimate().threshold_pct_mso == 48
    assert search.ask() == 48


def test_five_of_ten_ends_where_the_steps_of_the_stimulator_are_larger_than_its_own() -> None:
    search = ThresholdSearch("five-of-ten", FiveOfTen(large_step_pct_mso=4), IntensityRange(20, 100, 10))
    assert run(search, lambda intensity: intensity >= 55).estimate().threshold_pct_mso == 60


def test_five_of_ten_needs_five() -> None:
    method = FiveOfTen(start_pct_mso=50)
    four = [Pulse(50, response=number < 4) for number in range(9)]
    assert method.ask(four, SPACE) == 50
    assert method.ask([*four, Pulse(50, response=True)], SPACE) == 45
    assert method.ask([*four, Pulse(50, response=False)], SPACE) == 55


def test_maximum_likelihood_lies_between_a_response_and_none() -> None:
    method = MaximumLikelihood()
    pulses = [Pulse(50, response=False), Pulse(60, response=True)]
    found = method.estimate(pulses, SPACE)
    assert found.threshold_pct_mso == pytest.approx(54.8, abs=0.5)
    assert found.low_pct_mso is not None
    assert found.high_pct_mso is not None
    assert found.low_pct_mso < 52
    assert found.high_pct_mso > 58


def test_an_amplitude_tells_more_than_that_there_was_one() -> None:
    seen, measured = (
        BayesThreshold().estimate([first, Pulse(50, response=False)], SPACE)
        for first in (Pulse(60, response=True), Pulse(60, 0.06))
    )
    assert (measured.sd_pct_mso or 99.0) < (seen.sd_pct_mso or 0.0)


def test_the_posterior_is_a_distribution_and_does_not_depend_on_the_order() -> None:
    pulses = [Pulse(60, 0.3), Pulse(50, 0.01), Pulse(55, response=True)]
    posterior = BayesThreshold().posterior(pulses)
    assert posterior.sum() == pytest.approx(1.0)
    assert BayesThreshold().posterior(pulses[::-1]) == pytest.approx(posterior, abs=1e-12)
    assert THRESHOLDS_PCT_MSO @ posterior == pytest.approx(53.0, abs=4.0)


def test_one_odd_response_does_not_deceive_the_posterior() -> None:
    pulses = [Pulse(40, 2.0), *[Pulse(60, 0.01)] * 4, *[Pulse(66, 0.1)] * 4]
    found = BayesThreshold().estimate(pulses, SPACE).threshold_pct_mso
    assert found == pytest.approx(64.0, abs=3.0)


def test_bayes_stops_for_its_budget() -> None:
    search = run(make_threshold_search("bayes", SPACE, stop_sd_pct_mso=0.01, max_pulses=5), lambda x: x >= 60)
    assert len(search.pulses) == 5
    assert "budget" in search.decision().reason


@pytest.mark.parametrize("method", [BayesThreshold, MaximumLikelihood])
def test_a_threshold_beyond_the_range_is_no_number(method: Callable[[], BayesThreshold | MaximumLikelihood]) -> None:
    space = IntensityRange(20, 70)
    pulses = [Pulse(70, response=False)] * 8 + [Pulse(70, response=True)]
    found = method().estimate(pulses, space)
    assert found.threshold_pct_mso is None
    assert "above the highest intensity" in found.reason


def test_a_search_that_ends_with_a_threshold_beyond_the_range_does_not_call_it_known() -> None:
    pulses = [Pulse(70, response=False)] * 8 + [Pulse(70, response=True)]
    ended = BayesThreshold(stop_sd_pct_mso=10.0).decision(pulses[4:], IntensityRange(20, 70))
    assert ended.stop
    assert ended.reason.startswith("The threshold is probably above the highest intensity, 70 % MSO")


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: BayesThreshold(stop_sd_pct_mso=0),
        lambda: BayesThreshold(prior_mean_pct_mso=200),
        lambda: MaximumLikelihood(pulses=0),
        lambda: FiveOfTen(enough=11),
    ],
)
def test_settings_that_cannot_be_are_refused(wrong: Callable[[], object]) -> None:
    with pytest.raises(InvalidValueError):
        wrong()


@pytest.mark.slow
@pytest.mark.parametrize("cohort", ["recruitment", "hand"])
def test_within_twelve_pulses_the_mean_error_is_at_most_2_pct_mso_and_intervals_cover(cohort: str) -> None:
    errors, covered = [], []
    for number, person in enumerate(threshold_cohort(cohort, 30, 2)):
        search, responder = make_threshold_search("bayes", SPACE, stop_sd_pct_mso=0.01), person.begin(number)
        for _ in range(12):
            intensity = search.ask()
            search.tell(intensity, responder.respond(intensity))
        found = search.estimate()
        errors.append(abs((found.threshold_pct_mso or np.inf) - person.rmt_pct_mso))
        covered.append((found.low_pct_mso or 0) <= person.rmt_pct_mso <= (found.high_pct_mso or 0))
    assert np.mean(errors) < 2.0
    assert np.mean(covered) > 0.9 - 3 * 0.3 / np.sqrt(30)
