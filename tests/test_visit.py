"""A visit: what is noted about it, and the protocol of its stimuli."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from isiw import schedule
from isiw.errors import InvalidValueError
from isiw.session.stated import require_protocol
from isiw.visit import Control, Visit, VisitProtocol

MIXED = VisitProtocol(tms_alone=0.1, tap_alone=0.05)


def controls(protocol: VisitProtocol, seed: int, trials: int = 600) -> dict[int, Control]:
    drawn = {trial: schedule.control(protocol, trial, seed) for trial in range(trials)}
    return {trial: control for trial, control in drawn.items() if control is not None}


@pytest.mark.parametrize("seed", range(5))
def test_each_kind_of_control_has_its_share(seed: int) -> None:
    kinds = list(controls(MIXED, seed).values())
    assert (kinds.count(Control.TMS_ALONE), kinds.count(Control.TAP_ALONE)) == (60, 30)


@pytest.mark.slow
@pytest.mark.parametrize(("tms", "tap"), [(0.3, 0.0), (0.0, 0.07), (0.5, 0.4), (1 / 3, 1 / 3), (0.001, 0.0)])
def test_any_shares_are_kept(tms: float, tap: float) -> None:
    kinds = list(controls(VisitProtocol(tms_alone=tms, tap_alone=tap), 1, 6000).values())
    assert kinds.count(Control.TMS_ALONE) == pytest.approx(6000 * tms, abs=1)
    assert kinds.count(Control.TAP_ALONE) == pytest.approx(6000 * tap, abs=1)


def test_controls_are_spread_over_the_session_and_come_at_other_places_each_time() -> None:
    for seed in range(5):
        places = list(controls(MIXED, seed))
        assert all(after - before < 2 / 0.15 + 1 for before, after in pairwise(places))
    gaps = {after - before for before, after in pairwise(controls(MIXED, 0))}
    assert len(gaps) > 5
    assert controls(MIXED, 0) != controls(MIXED, 1)
    assert controls(MIXED, 0) == controls(MIXED, 0)


def test_without_shares_there_are_no_controls() -> None:
    assert controls(VisitProtocol(), 0) == {}


def test_intervals_are_drawn_from_their_range_for_each_trial() -> None:
    protocol = VisitProtocol(iti_s=(5.0, 8.0))
    drawn = [schedule.interval_s(protocol, trial, 3) for trial in range(200)]
    assert all(5.0 <= interval_s <= 8.0 for interval_s in drawn)
    assert (min(drawn) < 5.2, max(drawn) > 7.8) == (True, True)
    assert len(set(drawn)) == 200
    assert drawn == [schedule.interval_s(protocol, trial, 3) for trial in range(200)]
    assert drawn != [schedule.interval_s(protocol, trial, 4) for trial in range(200)]


def test_a_rest_comes_after_each_block_and_never_first() -> None:
    protocol = VisitProtocol(iti_s=(5.0, 8.0), block_trials=12, rest_s=120.0)
    rests = [trial for trial in range(40) if schedule.interval_s(protocol, trial, 0) == 120.0]
    assert rests == [12, 24, 36] == [trial for trial in range(40) if schedule.rests_before(protocol, trial)]


@pytest.mark.parametrize(
    "wrong",
    [
        {"iti_s": (8.0, 5.0)},
        {"iti_s": (5.0,)},
        {"iti_s": 5.0},
        {"iti_s": (-1.0, 5.0)},
        {"iti_s": (5000.0, 8000.0)},
        {"tms_alone": 1.0},
        {"tms_alone": 0.5, "tap_alone": 0.5},
        {"tap_alone": -0.1},
        {"block_trials": 0},
        {"rest_s": 0.0},
    ],
)
def test_a_protocol_that_makes_no_sense_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=r"VisitProtocol|leave no pairs"):
        VisitProtocol(**wrong)


@pytest.mark.parametrize(("iti_s", "min_iti_s"), [((5.0, 8.0), 0.0), (None, 8.0), ((8.0, 8.0), 5.0)])
def test_a_rest_that_is_no_longer_than_the_longest_interval_is_refused_where_it_is_stated(
    iti_s: tuple[float, float] | None, min_iti_s: float
) -> None:
    for rest_s in (2.0, 7.0, 8.0):
        protocol = VisitProtocol(iti_s=iti_s, block_trials=3, rest_s=rest_s)
        with pytest.raises(InvalidValueError, match=r"rest_s above 8"):
            require_protocol(protocol, min_iti_s)
    require_protocol(VisitProtocol(iti_s=iti_s, block_trials=3, rest_s=8.1), min_iti_s)
    require_protocol(VisitProtocol(iti_s=iti_s, rest_s=2.0), min_iti_s)


@pytest.mark.parametrize("wrong", [{"day": 0}, {"operator": 7}, {"intensity_pct_rmt": 0.0}, {"muscle": None}])
def test_a_note_of_the_wrong_kind_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=r"Visit\."):
        Visit(**wrong)


def test_visits_are_unlike_where_both_note_another_muscle_or_a_clearly_different_intensity() -> None:
    noted = Visit(muscle="FCR", intensity_pct_rmt=110.0)
    for like in (Visit(), Visit(muscle=" fcr"), Visit(intensity_pct_rmt=120.0), Visit(day=2, muscle="FCR"), noted):
        assert noted.unlike(like) is None
        assert like.unlike(noted) is None
    assert noted.unlike(Visit(muscle="FDI")) == "different muscles, FCR and FDI"
    assert noted.unlike(Visit(intensity_pct_rmt=99.5)) == "different intensities, 110 and 99.5 % of RMT"


@pytest.mark.parametrize("iti_s", [(2.0, 4.0), (2.0, 5.0), (3.0, 3.0)])
def test_intervals_that_the_limits_replace_are_refused_where_they_are_stated(iti_s: tuple[float, float]) -> None:
    with pytest.raises(InvalidValueError, match="intervals up to more than 5 s"):
        require_protocol(VisitProtocol(iti_s=iti_s), 5.0)


def test_an_intensity_of_tms_alone_in_another_unit_is_refused_where_it_is_stated() -> None:
    with pytest.raises(InvalidValueError, match=r"alone_pct_rmt is probably in another unit.*Multiply by 100"):
        require_protocol(VisitProtocol(tms_alone=0.2, alone_pct_rmt=1.0), 5.0)


@pytest.mark.parametrize("iti_s", [(2.0, 6.0), (5.0, 5.0), None])
def test_intervals_of_which_some_are_longer_than_the_limits_are_kept(iti_s: tuple[float, float] | None) -> None:
    require_protocol(VisitProtocol(iti_s=iti_s), 5.0)
