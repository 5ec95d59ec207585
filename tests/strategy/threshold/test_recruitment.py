"""The likelihood of an MEP by distance from the threshold, beside the simulated people that it knows nothing of."""

from __future__ import annotations

import numpy as np
import pytest

from isiw.errors import InvalidValueError
from isiw.strategy.threshold.bayes import DISTANCES_PCT, ODD, RecruitmentPrior, log_likelihood
from isiw.subjects.responses import EmgFloor, RecruitmentResponse
from isiw.subjects.thresholds import StimulatedPerson

PRIOR = RecruitmentPrior()


def without_odd(
    log: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.asarray((np.exp(log) - 0.5 * ODD) / (1 - ODD))


def test_at_the_threshold_half_of_the_pulses_are_answered_whatever_the_curve() -> None:
    at_threshold = without_odd(log_likelihood(PRIOR, None, responded=True)[DISTANCES_PCT == 0])
    assert at_threshold == pytest.approx(0.5, abs=0.005)


def test_all_amplitudes_together_are_certain() -> None:
    few = RecruitmentPrior(slopes_per_pct=(0.3,), amplitudes_mv=(0.1, 1.0))
    amplitudes = np.geomspace(few.visible_mv, 30.0, 100)
    densities = [np.exp(log_likelihood(few, mep, responded=mep > 0.05)) for mep in amplitudes.tolist()]
    hidden = np.exp(log_likelihood(few, 0.0, responded=False))
    total = np.trapezoid(densities, np.log(amplitudes), axis=0) + hidden
    assert total == pytest.approx(1.0, abs=0.03)


def test_it_is_what_simulated_people_do() -> None:
    one = RecruitmentPrior(slopes_per_pct=(0.3,), sigmas_x_pct=(7.0,), amplitudes_mv=(0.3,), sigma_y=0.4)
    response = RecruitmentResponse(EmgFloor(one.floor_mv, one.floor_log_sd), 0.3, 0.3, 100.0, 0.0, 7.0, 0.4)
    person = StimulatedPerson(50.0, response)
    believed = without_odd(log_likelihood(one, None, responded=True))[:, 0]
    for distance in (-20, -5, 0, 5, 20):
        truth = person.response_probability(50.0 * (1 + distance / 100))
        assert believed[distance == DISTANCES_PCT] == pytest.approx(truth, abs=0.005)


def test_a_large_mep_says_farther_above_than_a_small_one() -> None:
    small, large = (log_likelihood(PRIOR, mep, responded=True).sum(axis=1) for mep in (0.06, 0.6))
    assert DISTANCES_PCT[np.argmax(large)] > DISTANCES_PCT[np.argmax(small)] + 3


@pytest.mark.parametrize("wrong", [{"slopes_per_pct": (0.3, 0.2)}, {"sigma_y": 0.0}, {"visible_mv": 0.06}])
def test_a_belief_that_cannot_be_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InvalidValueError):
        RecruitmentPrior(**wrong)  # type: ignore[arg-type] # what is tested
