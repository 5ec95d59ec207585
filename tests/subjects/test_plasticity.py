from __future__ import annotations

from dataclasses import replace
from itertools import accumulate
from typing import Any

import numpy as np
import pytest

from isiw.design import IMPACT_SPACE
from isiw.errors import InvalidValueError
from isiw.subjects import EmgFloor, GainResponse, PeakProfile, Plasticity, SimulatedSubject
from isiw.types import FloatArray

BEST_MS, OUTSIDE_MS = 90.0, 400.0
PERSON = SimulatedSubject(
    PeakProfile(50.0, 80.0), GainResponse(EmgFloor(0.001, 0.0), gain_mv=0.1, cv=0.2), 180.0, hit_delay_sd_ms=0.0
)


def meps_mv(isi_ms: float | None, plasticity: Plasticity | None, before_ms: float | None = None) -> FloatArray:
    """200 MEPs at an ISI, after 200 pairs at another."""
    responder = replace(PERSON, plasticity=plasticity).begin(1)
    for _ in range(200):
        responder.respond(before_ms, "impact")
    return np.array([responder.respond(isi_ms, "impact").mep_mv for _ in range(200)])


@pytest.mark.parametrize("limit", [0.5, -0.5])
def test_pairs_in_the_window_change_what_later_pairs_evoke(limit: float) -> None:
    plasticity = Plasticity(limit, pairs=20)
    changed, before = (meps_mv(BEST_MS, which, BEST_MS).mean() for which in (plasticity, None))
    assert np.log(changed / before) == pytest.approx(limit, abs=0.01)


@pytest.mark.parametrize(("before_ms", "log_change"), [(None, 0.0), (OUTSIDE_MS, 0.0), (BEST_MS, 0.5)])
def test_pairs_in_the_window_change_the_next_mep_and_nothing_else_does(
    before_ms: float | None, log_change: float
) -> None:
    changed, unchanged = (meps_mv(BEST_MS, which, before_ms)[0] for which in (Plasticity(0.5, pairs=20), None))
    assert np.log(changed / unchanged) == pytest.approx(log_change, abs=0.03)


def test_the_change_comes_with_the_dose_and_stays_below_its_limit() -> None:
    plasticity = Plasticity(0.4, pairs=100)
    gains = list(accumulate(range(2000), lambda gain, pair: plasticity.after(gain, 1.0, pair), initial=0.0))
    assert gains[100] == pytest.approx(0.4 * (1 - np.exp(-1)))
    assert gains[2000] == pytest.approx(0.4)


def test_the_truth_about_a_person_is_that_before_the_first_pair() -> None:
    assert replace(PERSON, plasticity=Plasticity(1.0)).window(IMPACT_SPACE) == PERSON.window(IMPACT_SPACE)


@pytest.mark.parametrize("wrong", [{"limit": np.inf}, {"limit": 0.1, "pairs": 0.0}])
def test_settings_that_cannot_be_are_errors(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        Plasticity(**wrong)
