"""The trials told so far."""

from __future__ import annotations

import math

import numpy as np
import pytest

from isiw.errors import StrategyError
from isiw.models.protocol import Observation
from isiw.models.shared.history import AmplitudeHistory, History, observed

LIMIT_MV, THRESHOLD_MV = 0.005, 0.05


def interval(mep_mv: float | None, *, response: bool | None = None) -> tuple[float, float]:
    """The interval of log mV that is known of one trial."""
    trial = observed(Observation.of([100.0], [mep_mv], None, [response]), LIMIT_MV, THRESHOLD_MV, order=3)
    assert trial.columns[0, 0, 4] == 3
    return ends(trial)


def ends(trial: History) -> tuple[float, float]:
    low, high = trial.log_mep[0, 0].tolist()
    return low, high


def test_an_amplitude_is_a_point() -> None:
    assert interval(0.08) == pytest.approx((math.log(0.08), math.log(0.08)))


def test_an_amplitude_of_zero_is_anything_below_the_detection_limit() -> None:
    assert interval(0.0) == pytest.approx((-math.inf, math.log(LIMIT_MV)))


def test_a_response_is_above_the_threshold_and_its_absence_below() -> None:
    assert interval(None, response=True) == pytest.approx((math.log(THRESHOLD_MV), math.inf))
    assert interval(None, response=False) == pytest.approx((-math.inf, math.log(THRESHOLD_MV)))


def test_an_interval_ends_where_it_was_told_to() -> None:
    trial = observed(Observation.of([1.0], [0.03], None, [None], [0.05]), LIMIT_MV, THRESHOLD_MV, order=0)
    assert ends(trial) == pytest.approx((math.log(0.03), math.log(0.05)))
    below = observed(Observation.of([1.0], [0.0], None, [None], [0.01]), LIMIT_MV, THRESHOLD_MV, order=0)
    assert ends(below) == pytest.approx((-math.inf, math.log(0.01)))
    assert AmplitudeHistory.nothing(1).appended(Observation.of([1.0], [0.0], None, [None], [0.01])).mep_mv[0, 0] == (
        pytest.approx(0.005)
    )


def test_of_an_interval_its_middle_is_kept_and_of_an_amplitude_beside_it_itself() -> None:
    told = Observation.of([1.0, 1.0], [0.1, 0.2], None, [None, None], [0.3, math.nan])
    assert AmplitudeHistory.nothing(2).appended(told).mep_mv[:, 0] == pytest.approx([0.2, 0.2])


def test_a_known_part_is_kept_and_taken_off_for_models_that_know_none() -> None:
    told = Observation.of([1.0], [0.3], known_mv=[(0.1, 0.05, 0.4)])
    trial = observed(told, LIMIT_MV, THRESHOLD_MV, order=0)
    assert trial.columns[0, 0, 5:].tolist() == pytest.approx([0.1, 0.05, 0.4, 0.0, math.nan, 1.0], nan_ok=True)
    assert AmplitudeHistory.nothing(1).appended(told).mep_mv[0, 0] == pytest.approx(0.2)


def test_the_intensity_of_a_pulse_is_kept_beside_its_known_part() -> None:
    told = Observation.of([None], [0.3], known_mv=[(0.0, 0.05, 0.0)], shift_pct_rmt=[20.0])
    trial = observed(told, LIMIT_MV, THRESHOLD_MV, order=0)
    around = [0.0, 0.05, 0.0, 20.0, 0.0, 1.0]
    assert trial.columns[0, 0, 5:].tolist() == pytest.approx(around, nan_ok=True)


def test_a_history_grows_by_one_trial_of_each_person_and_stays_what_it_was() -> None:
    empty = History.empty(2)
    trial = observed(Observation.of([100.0, None], [0.1, 0.2]), LIMIT_MV, THRESHOLD_MV, order=0)
    longer = empty.appended(trial).appended(trial)
    assert (empty.isi_ms.shape, longer.isi_ms.shape) == ((2, 0), (2, 2))
    assert longer.isi_ms[0].tolist() == [100.0, 100.0]
    assert np.isnan(longer.isi_ms[1]).all()


def test_trials_of_tms_alone_are_kept_apart() -> None:
    told = AmplitudeHistory.nothing(2)
    told = told.appended(Observation.of([100.0, None], [0.1, 0.02])).appended(Observation.of([None, 50.0], [0.01, 0.3]))
    assert (told.trials, told.people) == (2, 2)
    second = told.person(1)
    assert (second.isi_ms.tolist(), second.mep_mv.tolist()) == ([50.0], pytest.approx([0.3]))
    np.testing.assert_allclose(second.baseline_mv, [0.02])


def test_a_response_without_amplitude_is_refused_with_the_way_out() -> None:
    with pytest.raises(StrategyError, match=r"amplitudes only.*Tell mep_mv"):
        AmplitudeHistory.nothing(1).appended(Observation.of([100.0], [None], None, [True]))
