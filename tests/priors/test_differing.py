"""How windows differ: between two days of one person, and between two people."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from isiw.design import IMPACT_SPACE
from isiw.errors import InvalidValueError
from isiw.log.record import SessionRecord, read_session
from isiw.priors import Difference, differences
from isiw.types import Conditioning, Reference
from isiw.visit import Visit
from known import known
from priors.logged import person, write_log


@pytest.fixture(scope="module")
def records(tmp_path_factory: Any) -> list[SessionRecord]:
    """P1 early, P2 late, P1 late, somebody without a window, and P1 early again."""
    folder: Path = tmp_path_factory.mktemp("sessions")
    sessions = [
        ("P1", person(20.0)), ("P2", person(200.0)), ("P1", person(200.0)), ("P3", person(20.0, gain=0.0)),
        ("P1", person(24.0)),
    ]  # fmt: skip
    return [
        read_session(write_log(folder / f"{number}.mcap", who, subject=subject, trials=14, seed=number + 1))
        for number, (subject, who) in enumerate(sessions)
    ]


@pytest.fixture(scope="module")
def found(records: list[SessionRecord]) -> list[Difference]:
    return differences(records)


@pytest.mark.slow
def test_a_window_that_is_later_is_said_to_be_later(found: list[Difference]) -> None:
    assert known(found[0].starts_later) > 0.95
    assert known(found[0].ends_later) > 0.95


def test_only_of_the_same_person_it_is_said_whether_the_window_moved(found: list[Difference]) -> None:
    assert [difference.same_person for difference in found] == [False, True, False, True]
    assert found[0].moved is None
    assert known(found[1].moved) > 0.9
    assert known(found[3].moved) < 0.3


def test_of_windows_at_the_same_place_neither_is_later(found: list[Difference]) -> None:
    assert 0.05 < known(found[3].starts_later) < 0.95


def test_of_another_muscle_it_is_said_why_nobody_knows_whether_the_window_moved(records: list[SessionRecord]) -> None:
    of_muscles = [
        replace(record, header=record.header.model_copy(update={"visit": Visit(muscle=muscle)}))
        for record, muscle in ((records[0], "FCR"), (records[2], "FDI"))
    ]
    difference = differences(of_muscles)[0]
    assert difference.moved is None
    assert difference.obstacle.startswith("The sessions are of different muscles, FCR and FDI")
    assert known(difference.starts_later) > 0.9


def on_rig(record: SessionRecord, mean_ms: float, reference: Reference = "valve") -> SessionRecord:
    device = replace(record.header.device, hit_delay_ms=(mean_ms, 3.0), reference=reference)
    space = replace(record.header.space, reference=reference)
    return replace(record, header=record.header.model_copy(update={"device": device, "space": space}))


def test_windows_on_rigs_with_other_hit_delays_are_not_compared(records: list[SessionRecord]) -> None:
    difference = differences([on_rig(records[0], 100.0), on_rig(records[1], 250.0)])[0]
    assert (difference.starts_later, difference.ends_later, difference.moved) == (None, None, None)
    assert "different hit delays, 100 and 250 ms" in difference.obstacle


def test_windows_on_rigs_with_nearly_the_same_hit_delay_or_after_the_impact_are_compared(
    records: list[SessionRecord], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("isiw.priors.differing._edges", lambda _: np.zeros((1, 2)))
    near = [on_rig(records[0], 100.0), on_rig(records[1], 110.0)]
    after_impact = [on_rig(records[0], 100.0, "impact"), on_rig(records[1], 250.0, "impact")]
    for pair in (near, after_impact, [records[0], near[1]]):
        assert differences(pair)[0].starts_later == 0.5


def test_windows_after_a_tap_and_after_an_electrical_pulse_are_not_compared(tmp_path: Path) -> None:
    tapped, pulsed = (
        read_session(write_log(tmp_path / f"{first}.mcap", person(20.0), space=IMPACT_SPACE, conditioning=first))
        for first in get_args(Conditioning)
    )
    difference = differences([tapped, pulsed])[0]
    assert (difference.starts_later, difference.ends_later, difference.moved) == (None, None, None)
    assert "different conditioning stimuli" in difference.obstacle


def test_another_intensity_is_named_beside_a_difference(records: list[SessionRecord]) -> None:
    at = [
        replace(record, header=record.header.model_copy(update={"visit": Visit(intensity_pct_rmt=intensity)}))
        for record, intensity in zip(records[:2], (90.0, 120.0), strict=True)
    ]
    difference = differences(at)[0]
    assert difference.starts_later is not None
    assert difference.obstacle.startswith("The sessions are of different intensities, 90 and 120 % of RMT")


def in_range(record: SessionRecord, low_ms: float, high_ms: float) -> SessionRecord:
    space = replace(record.header.space, low_ms=low_ms, high_ms=high_ms)
    return replace(record, header=record.header.model_copy(update={"space": space}))


def test_edges_are_compared_in_the_range_that_both_sessions_have(
    records: list[SessionRecord], monkeypatch: pytest.MonkeyPatch
) -> None:
    edges_ms = {0.0: np.array([[64.0, 166.0]]), 80.0: np.array([[-np.inf, 170.0]])}
    monkeypatch.setattr("isiw.priors.differing._edges", lambda record: edges_ms[record.header.space.low_ms])
    pair = [in_range(records[0], 0.0, 320.0), in_range(records[1], 80.0, 320.0)]
    assert (differences(pair)[0].starts_later, differences(pair)[0].ends_later) == (0.5, 1.0)
    apart = differences([in_range(records[0], 0.0, 60.0), pair[1]])[0]
    assert (apart.starts_later, apart.ends_later, apart.moved) == (None, None, None)
    assert "0–60 and 80–320 ms, have nothing in common" in apart.obstacle


def test_of_a_session_without_a_window_nothing_is_said_but_why(found: list[Difference]) -> None:
    assert (found[2].starts_later, found[2].ends_later, found[2].moved) == (None, None, None)
    assert "probably no window" in found[2].obstacle
    assert "3.mcap" in found[2].obstacle


def test_sessions_without_a_code_are_not_taken_for_one_person(records: list[SessionRecord]) -> None:
    nameless = replace(records[0], header=records[0].header.model_copy(update={"subject": ""}), history=())
    assert not differences([nameless, nameless])[0].same_person


def test_the_earlier_day_comes_first_however_the_logs_are_given(
    records: list[SessionRecord], monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []

    def note(first: SessionRecord, second: SessionRecord) -> float:
        order.extend((first.header.created, second.header.created))
        return 0.5

    monkeypatch.setattr("isiw.priors.differing.moved", note)
    monkeypatch.setattr("isiw.priors.differing._edges", lambda _: np.zeros((1, 2)))
    earlier = records[0].header.model_copy(update={"created": "2026-11-19T10:00:00+00:00"})
    differences([records[2], replace(records[0], header=earlier)])
    assert order == ["2026-11-19T10:00:00+00:00", "2026-11-21T10:00:00+00:00"]


def test_one_session_and_sessions_on_different_clocks_are_refused(records: list[SessionRecord]) -> None:
    with pytest.raises(InvalidValueError, match="at least two"):
        differences(records[:1])
    other = records[1].header.model_copy(update={"space": IMPACT_SPACE})
    with pytest.raises(InvalidValueError, match="different events"):
        differences([records[0], replace(records[1], header=other)])
