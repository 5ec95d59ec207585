"""What is done about the EMG floor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from isiw.errors import InvalidValueError
from isiw.models.shared.history import FloorKind, FloorTreatment, PersonTrials


def trials(mep_mv: list[float], baseline_mv: list[float] | None = None) -> PersonTrials:
    return PersonTrials(np.arange(float(len(mep_mv))), np.array(mep_mv), np.array(baseline_mv or []))


def test_the_floor_is_the_mean_of_the_meps_of_tms_alone_where_there_are_any() -> None:
    assert FloorTreatment().level_mv(trials([0.1, 0.2], [0.01, 0.03])) == pytest.approx(0.02)


def test_without_tms_alone_the_floor_is_the_median_of_all_meps() -> None:
    assert FloorTreatment().level_mv(trials([0.01, 0.3, 0.02])) == 0.02
    assert FloorTreatment().level_mv(trials([])) == 0.0


def test_the_lowest_tenth_is_no_higher_where_most_trials_lie_inside_the_window() -> None:
    inside = [0.01, 0.012, 0.2, 0.25, 0.3, 0.22, 0.28, 0.31, 0.26, 0.24, 0.27]
    assert FloorTreatment("lowest").level_mv(trials(inside)) == pytest.approx(0.012)
    assert FloorTreatment("subtracted").level_mv(trials(inside)) > 0.2


@pytest.mark.parametrize("kind", ["median", "lowest"])
def test_tms_alone_does_not_change_a_floor_that_is_guessed_from_the_pairs(kind: FloorKind) -> None:
    pairs = [0.01, 0.012, 0.2, 0.25, 0.3]
    assert FloorTreatment(kind).level_mv(trials(pairs, [0.05])) == FloorTreatment(kind).level_mv(trials(pairs))


@pytest.mark.parametrize("kind", ["zeroed", "raw"])
def test_only_a_subtracted_floor_is_above_zero(kind: FloorKind) -> None:
    assert FloorTreatment(kind).level_mv(trials([0.1, 0.2], [0.01])) == 0.0


def test_what_is_above_the_floor_depends_on_its_kind() -> None:
    mep_mv = np.array([0.01, 0.03])
    assert FloorTreatment("subtracted").excess_mv(mep_mv, 0.02).tolist() == pytest.approx([-0.01, 0.01])
    assert FloorTreatment("zeroed", threshold_mv=0.02).excess_mv(mep_mv, 0.0).tolist() == [0.0, 0.03]
    assert FloorTreatment("raw").excess_mv(mep_mv, 0.0).tolist() == [0.01, 0.03]


@pytest.mark.parametrize("settings", [{"floor": "cut"}, {"threshold_mv": 0.0}, {"threshold_mv": float("nan")}])
def test_an_unknown_treatment_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=r"floor|threshold_mv"):
        FloorTreatment(**settings)
