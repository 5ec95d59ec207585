"""Stimuli, measurements, trials and their table: what they refuse and what they give back."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from isiw.errors import InvalidValueError
from isiw.findings import Kind
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import Status, Stimulus, Trial, TrialTable

NOT_FINITE = [math.nan, math.inf, -math.inf]


def accepted(index: int, mep_mv: float = 0.05) -> Trial:
    return Trial(index, Status.ACCEPTED, 100.0, isi_ms=101.0, mep_mv=mep_mv)


def excluding(index: int) -> Callable[[Trial], Trial]:
    return lambda trial: dataclasses.replace(trial, excluded=trial.excluded or trial.index == index)


def mistrial(index: int) -> Trial:
    return Trial(index, Status.MISTRIAL, 100.0, reason=Kind.NO_PULSE)


def test_a_stimulus_without_an_isi_is_tms_alone() -> None:
    assert Stimulus(0, None).isi_ms is None


@pytest.mark.parametrize("isi_ms", NOT_FINITE)
def test_a_stimulus_needs_a_finite_isi(isi_ms: float) -> None:
    with pytest.raises(InvalidValueError, match=r"Stimulus\.isi_ms"):
        Stimulus(0, isi_ms)


def test_trials_count_from_0() -> None:
    with pytest.raises(InvalidValueError, match="at least 0"):
        Stimulus(-1, 10.0)


@pytest.mark.parametrize("name", ["mep_mv", "isi_sd_ms", "background_rms_uv"])
@pytest.mark.parametrize("value", [*NOT_FINITE, -0.001])
def test_an_invalid_amplitude_is_named(name: str, value: float) -> None:
    values: dict[str, Any] = {"mep_mv": 0.1, name: value}
    with pytest.raises(InvalidValueError, match=name):
        Measurement(isi_ms=10.0, **values)
    with pytest.raises(InvalidValueError, match=name):
        Trial(0, Status.ACCEPTED, 10.0, **values)


@pytest.mark.parametrize("name", ["isi_ms", "t_valve_ms", "t_hit_ms", "t_tms_ms"])
@pytest.mark.parametrize("value", NOT_FINITE)
def test_a_time_that_is_not_finite_is_named(name: str, value: float) -> None:
    times: dict[str, Any] = {name: value}
    with pytest.raises(InvalidValueError, match=name):
        Measurement(**({"mep_mv": 0.1, "isi_ms": 10.0} | times))
    with pytest.raises(InvalidValueError, match=name):
        Trial(0, Status.ACCEPTED, 10.0, mep_mv=0.1, **times)


def test_a_channel_keeps_its_samples_as_floats() -> None:
    channel = Channel(np.array([1, 2, 3]), 1000.0, "mV")
    assert channel.values.dtype == np.float64


@pytest.mark.parametrize(
    ("values", "rate_hz", "t0_ms"),
    [([[1.0]], 1000.0, 0.0), ([1.0], 0.0, 0.0), ([1.0], math.nan, 0.0), ([1.0], math.inf, 0.0), ([1.0], 1e3, math.nan)],
)
def test_a_channel_that_is_not_a_waveform_is_refused(values: list[object], rate_hz: float, t0_ms: float) -> None:
    with pytest.raises(InvalidValueError):
        Channel(np.array(values), rate_hz, "mV", t0_ms)


def test_the_unit_of_a_channel_is_a_text() -> None:
    with pytest.raises(InvalidValueError, match=r"Channel\.unit must"):
        Channel(np.array([1.0]), 1000.0, None)  # type: ignore[arg-type]


@pytest.mark.parametrize("times", [{"t_tms_ms": math.nan}, {"t_hit_ms": math.inf}, {"isi_sd_ms": -1.0}])
def test_a_sweep_with_impossible_times_is_refused(times: dict[str, float]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(times))):
        Sweep({}, **times)


def test_a_mistrial_needs_a_reason_and_an_accepted_trial_has_none() -> None:
    with pytest.raises(InvalidValueError, match="needs a reason"):
        Trial(0, Status.MISTRIAL, 10.0)
    with pytest.raises(InvalidValueError, match="has none"):
        Trial(0, Status.ACCEPTED, 10.0, reason=Kind.NO_PULSE, mep_mv=0.1)


def test_the_error_of_an_isi_is_realised_minus_commanded() -> None:
    assert accepted(0).isi_error_ms == 1.0
    assert mistrial(0).isi_error_ms is None


def test_an_accepted_trial_needs_its_mep() -> None:
    with pytest.raises(InvalidValueError, match="needs its MEP"):
        Trial(0, Status.ACCEPTED, 10.0)


def test_status_and_reason_may_be_given_in_words() -> None:
    words: dict[str, Any] = {"status": "mistrial", "reason": "no impact"}
    trial = Trial(0, commanded_isi_ms=10.0, **words)
    assert (trial.status, trial.reason) == (Status.MISTRIAL, Kind.NO_IMPACT)


def test_a_reason_outside_the_closed_list_is_refused() -> None:
    words: dict[str, Any] = {"reason": "bad luck"}
    with pytest.raises(ValueError, match="bad luck"):
        Trial(0, Status.MISTRIAL, 10.0, **words)


def test_a_strategy_learns_neither_from_mistrials_nor_from_excluded_trials() -> None:
    table = TrialTable((accepted(0), mistrial(1), accepted(2), accepted(3))).changed(excluding(2))
    assert [trial.index for trial in table.told] == [0, 3]
    assert len(table) == 4


def test_appending_and_excluding_leave_the_table_itself_as_it_was() -> None:
    table = TrialTable((accepted(0),))
    longer = table.appended(accepted(1)).changed(excluding(0))
    assert [trial.excluded for trial in longer] == [True, False]
    assert [trial.excluded for trial in table] == [False]
    assert longer[1] == accepted(1)


@pytest.mark.parametrize("indices", [(1, 0), (0, 0)])
def test_indices_ascend(indices: tuple[int, int]) -> None:
    with pytest.raises(InvalidValueError, match="ascend"):
        TrialTable(tuple(accepted(index) for index in indices))


def test_a_table_is_printed_as_its_counts() -> None:
    assert str(TrialTable((accepted(0),))) == "1 delivered, 1 told"
    table = TrialTable((accepted(0), mistrial(1), mistrial(2), accepted(3))).changed(excluding(3))
    assert str(table) == "4 delivered, 1 told, 2 mistrials (2 no pulse), 1 excluded"


def test_an_amplitude_in_microvolts_is_no_measurement_and_no_trial() -> None:
    with pytest.raises(InvalidValueError, match=r"Divide by 1000"):
        Measurement(2000.0, 50.0)
    with pytest.raises(InvalidValueError, match=r"more than any amplifier gives"):
        Trial(0, Status.ACCEPTED, 50.0, isi_ms=50.0, mep_mv=2000.0)
