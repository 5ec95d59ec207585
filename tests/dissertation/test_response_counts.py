from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from benchmarks.dissertation.counted import STIMULATION, study_counts

from isiw.dissertation.response_counts import (
    by_isi,
    count_trials,
    effective_window,
    response_counts,
    response_threshold_mv,
)
from isiw.errors import InvalidValueError
from isiw.trials import Status, Trial
from isiw.window import Window
from known import known


def test_responses_are_counted_by_isi() -> None:
    counts = response_counts([20, 10, 10, 20, 20], [0.05, 0.01, 0.04, 0.06, 0.02], threshold_mv=0.03)
    assert counts.index.tolist() == [10.0, 20.0]
    assert counts["trials"].tolist() == [2, 3]
    assert counts["responses"].tolist() == [1, 2]
    assert counts["share"].tolist() == pytest.approx([1 / 2, 2 / 3])


def test_exactly_40_percent_is_not_effective() -> None:
    counts = response_counts([0] * 5 + [5] * 5, [1, 1, 0, 0, 0, 1, 1, 1, 0, 0], threshold_mv=0.5)
    window = known(effective_window(counts))
    assert (window.start_ms, window.end_ms) == (5.0, 5.0)


def test_no_responses_make_no_window() -> None:
    assert effective_window(response_counts([0, 5, 10], [0.0, 0.01, 0.0], threshold_mv=0.03)) is None


def test_of_several_runs_the_one_about_the_peak_is_the_window() -> None:
    counts = response_counts([0, 0, 5, 5, 10, 10, 15, 15, 20, 20], [1, 0, 0, 0, 1, 0, 1, 1, 0, 0], threshold_mv=0.5)
    assert known(effective_window(counts)).segments == ((0.0, 0.0), (10.0, 15.0))
    assert known(effective_window(counts, segments="peak")).segments == ((10.0, 15.0),)


def test_a_person_has_the_threshold_that_few_of_their_own_trials_of_tms_alone_exceed() -> None:
    alone_mv = np.arange(1, 101) / 1000
    threshold_mv = response_threshold_mv(alone_mv)
    assert threshold_mv in alone_mv
    assert (alone_mv > threshold_mv).mean() <= 0.05
    assert (alone_mv >= threshold_mv).mean() > 0.05
    study = study_counts(STIMULATION["mechanical"], [60.0], threshold_mv=None, alone=200, seed=1)
    assert 0.03 <= study.alone_share <= 0.05
    assert study.counts["share"].loc[60.0] > study.alone_share


@pytest.mark.parametrize("alone_mv", [[], [np.nan], [-0.1], [[0.1]]])
def test_without_trials_of_tms_alone_there_is_no_threshold(alone_mv: list[float]) -> None:
    with pytest.raises(InvalidValueError, match="TMS alone"):
        response_threshold_mv(alone_mv)


def test_a_threshold_from_no_trials_of_tms_alone_is_an_error() -> None:
    with pytest.raises(InvalidValueError, match="TMS alone"):
        study_counts(STIMULATION["mechanical"], [60.0], threshold_mv=None)


def test_other_segments_are_an_error() -> None:
    with pytest.raises(InvalidValueError, match="segments"):
        effective_window(response_counts([0], [1], 0.5), segments=cast("Any", "last"))


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "width_ms"), [("electrical", 20.0), ("mechanical", 50.0)])
def test_the_two_kinds_of_stimulation_have_the_widths_of_the_dissertation(kind: str, width_ms: float) -> None:
    study = study_counts(STIMULATION[kind], np.arange(0.0, 140.0), trials=300, seed=1)
    assert (study.counts["share"] > 0.4).sum() == pytest.approx(width_ms, abs=4)


@pytest.mark.slow
def test_the_window_depends_on_the_threshold() -> None:
    widths = [
        study_counts(STIMULATION["mechanical"], np.arange(0.0, 140.0, 5.0), trials=100, threshold_mv=threshold, seed=1)
        for threshold in (0.02, 0.03, 0.05)
    ]
    low, middle, high = (known(study.window).width_ms for study in widths)
    assert low > middle > high


@pytest.mark.parametrize(
    ("isi", "mep", "threshold"), [([1, 2], [1], 0.1), ([1], [np.nan], 0.1), ([1], [1], 0.0), ([np.inf], [1], 0.1)]
)
def test_what_cannot_be_counted_is_an_error(isi: list[float], mep: list[float], threshold: float) -> None:
    with pytest.raises(InvalidValueError):
        response_counts(isi, mep, threshold)


@pytest.mark.parametrize(
    ("meps_mv", "threshold_mv", "said"),
    [
        ([40.0, 60.0], 0.03, "Is it in µV"),
        ([4e-5, 6e-5], 0.03, "Is it in V"),
        ([-0.1, 0.1], 0.03, "an amplitude is negative"),
        ([0.04, 0.06], 30.5, "threshold_mv must be"),
    ],
)
def test_amplitudes_in_another_unit_are_not_counted(meps_mv: list[float], threshold_mv: float, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        response_counts([10.0, 20.0], meps_mv, threshold_mv)


@pytest.mark.parametrize("share", [40.0, -1.0, float("nan")])
def test_a_share_is_no_percentage(share: float) -> None:
    with pytest.raises(InvalidValueError, match="the share of responses"):
        effective_window(response_counts([10.0, 20.0], [0.04, 0.06], 0.03), share)


def test_the_trials_of_a_session_are_counted_by_its_own_tms_alone() -> None:
    isis_ms = [*np.repeat([10.0, 50.0, 90.0], 4), *[None] * 20]
    meps_mv = [*[0.02] * 4, *[0.2] * 4, *[0.02] * 4, *np.linspace(0.01, 0.1, 20)]
    trials = [
        Trial(index, Status.ACCEPTED, isi_ms, isi_ms=isi_ms, mep_mv=mep_mv)
        for index, (isi_ms, mep_mv) in enumerate(zip(isis_ms, meps_mv, strict=True))
    ]
    study = count_trials(by_isi(trials))
    assert study.threshold_mv == pytest.approx(sorted(meps_mv[12:])[18])
    assert study.window == Window(50.0, 50.0)
    assert study.alone_share == 0.05
    assert count_trials(by_isi(trials[:12])).threshold_mv == 0.05
