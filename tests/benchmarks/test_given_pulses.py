"""Pulses given before the pairs: whose they are, and what is wrong with a wrong curve."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from benchmarks.given_pulses import Curve, Examined, compared, examined, given, main, session, wrong_curves

import isiw
from known import known

OVER_PCT_RMT = [90.0, 110.0, 130.0]
FLOOR_MV = 0.01


def of_curve(pulse: Curve) -> Examined:
    """A person of recruitment with some curve, and three pulses over it."""
    (subject,) = isiw.subjects.cohort("recruitment", 1, 0)
    return Examined(subject, pulse, FLOOR_MV, lambda _: OVER_PCT_RMT, 0)


def test_a_wrong_curve_is_another_level_scale_place_or_muscle() -> None:
    own, other = of_curve(lambda pct_rmt, _: pct_rmt / 100.0), of_curve(lambda pct_rmt, _: 7.0 * pct_rmt)
    curves = wrong_curves(own, other, 0)
    sizes = {name: [known(trial.mep_mv) for trial in given(own, curve, 3)] for name, curve in curves.items()}
    right = np.array(sizes["right"])
    assert right.tolist() == [0.9, 1.1, 1.3]
    assert sizes["level × 3"] == pytest.approx(3 * right)
    assert sizes["another muscle"] == pytest.approx(700 * right)
    factors = [np.divide(wrong_curves(own, other, seed)["scale off by 10 %"](100.0, 0), 1.0) for seed in range(9)]
    assert {round(float(factor), 3) for factor in factors} == {1.1, 0.909}
    shifted = [(x - FLOOR_MV) / (y - FLOOR_MV) for x, y in zip(sizes["coil moved"], right, strict=True)]
    assert shifted == sorted(shifted)
    assert 0.3 < shifted[0] < shifted[-1] < 0.8


def test_another_muscle_has_another_curve_and_the_same_window() -> None:
    ((own, other),) = examined(1, 5)
    assert own.subject.window(isiw.VALVE_SPACE) is not None
    assert own.pulse(130.0, 0) != other.pulse(130.0, 0)
    assert own.pulse(130.0, 0) == own.pulse(130.0, 0)
    assert own.over_pct_rmt(60) == other.over_pct_rmt(60)


def test_of_recorded_people_the_other_muscle_is_the_next_persons(shared_data: Path) -> None:
    del shared_data
    people = examined(11, 5, "curves")
    assert [(own.whose, other.whose) for own, other in people][8:] == [(9, 10), (10, 1), (1, 2)]
    assert list(people[0][0].over_pct_rmt(7)) != sorted(people[0][0].over_pct_rmt(7))


def test_gains_are_of_the_same_people() -> None:
    marks = {f"{name} {mark}": 0.5 for name in ("expected", "no fit", "law doubted") for mark in (10, 20)}
    rows = [
        {"known": known, "number": number, "whose": number, "F1 10": f1, "F1 20": f1, **marks}
        for known, by_number in {"nothing": (0.2, 0.8), "60 pulses": (0.3, 1.0)}.items()
        for number, f1 in enumerate(by_number)
    ]
    table = compared(pd.DataFrame(rows)).set_index("known")
    assert table["gain 20"].to_dict() == pytest.approx({"nothing": 0.0, "60 pulses": 0.15})
    assert table.loc["60 pulses", "gain 20 SE"] == pytest.approx(0.035, abs=0.003)


def test_a_session_goes_on_to_its_own_stop_or_to_the_last_pair() -> None:
    (subject,) = isiw.subjects.cohort("gaussian", 1, 0)
    until: dict[str, Any] = {"particles": 100, "stop_gain": 0.0, "stop_no_window": 1.0}
    sure = isiw.make_strategy("default", seed=1, **until, stop_width_ms=500.0, stop_expected_f1=1.0)
    never = isiw.make_strategy("default", seed=1, **until, stop_width_ms=1.0, stop_expected_f1=1.0)
    early, last = session(subject, 1, sure, 25), session(subject, 1, never, 25)
    assert early["stop pairs"] < 20  # it goes on to the last mark all the same
    assert early["F1 20"] == last["F1 20"]
    assert last["stop pairs"] == 25
    rows = [{"known": "nothing", "number": 0, "whose": 0, **last}, {"known": "60", "number": 0, "whose": 0, **early}]
    assert compared(pd.DataFrame(rows))["more pairs"].tolist() == [0.0, early["stop pairs"] - 25]


def test_without_the_recordings_it_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ISIW_SHARED_DATA", str(tmp_path / "nowhere"))
    main(people=1, recorded=True, out=tmp_path / "result")
    assert "the recordings are not at hand" in capsys.readouterr().out
