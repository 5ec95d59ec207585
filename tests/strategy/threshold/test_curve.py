"""Pulses over the recruitment curve: those that were named, and no others."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from isiw.errors import ConfigError, InvalidValueError, LimitExceededError
from isiw.session import open_threshold, resume_threshold
from isiw.session.given import given_pulses
from isiw.session.threshold import read_threshold, search_of
from isiw.strategy.threshold import IntensityRange, ThresholdSearch, make_threshold_search

SPACE = IntensityRange(20, 80)
AT = 45.0, 52.0, 60.0, 70.0


def curve(seed: int = 0, each: int = 3) -> ThresholdSearch:
    return make_threshold_search("curve", SPACE, at_pct_mso=AT, each=each, seed=seed)


def mep_mv(pct_mso: float) -> float:
    return 0.01 if pct_mso < 50 else 0.05 * (pct_mso - 48)


def asked_of(search: ThresholdSearch) -> list[float]:
    asked = []
    while not search.decision().stop:
        asked.append(search.ask())
        search.tell(asked[-1], mep_mv(asked[-1]))
    return asked


def test_each_named_intensity_is_asked_so_often_in_an_order_of_the_seed() -> None:
    orders = [asked_of(curve(seed)) for seed in (0, 0, 1)]
    assert all(Counter(order) == dict.fromkeys(AT, 3) for order in orders)
    assert orders[0] == orders[1] != orders[2]


def test_no_pulse_follows_those_that_were_named() -> None:
    search = curve()
    asked_of(search)
    assert search.estimate().threshold_pct_mso == pytest.approx(50, abs=4)
    with pytest.raises(LimitExceededError, match="all pulses that were named"):
        search.ask()


def test_a_curve_is_not_ended_where_all_its_pulses_are_answered() -> None:
    search = make_threshold_search("curve", SPACE, at_pct_mso=(70.0,), each=9)
    assert len(asked_of(search)) == 9
    assert search.estimate().threshold_pct_mso is None


@pytest.mark.parametrize("at", [(45.0, 90.0), (45.5,), (10.0,)])
def test_an_intensity_beyond_what_the_operator_allows_is_refused_before_the_first_pulse(at: tuple[float, ...]) -> None:
    with pytest.raises(LimitExceededError, match="beyond the limits"):
        make_threshold_search("curve", SPACE, at_pct_mso=at)


@pytest.mark.parametrize("at", [(), (45.0, 45.0)])
def test_intensities_are_named_each_once(at: tuple[float, ...]) -> None:
    with pytest.raises(ConfigError, match="Name them"):
        make_threshold_search("curve", SPACE, at_pct_mso=at)


def test_a_limit_that_does_not_hold_all_pulses_is_refused_with_their_sum(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match=r"12 pulses, max_pulses = 11.*--max-pulses 12"):
        open_threshold(curve(), tmp_path / "c.mcap", max_pulses=11)
    assert list(tmp_path.iterdir()) == []


def test_a_lost_pulse_is_asked_again_and_a_curve_goes_on_where_its_log_ends(tmp_path: Path) -> None:
    log, asked = tmp_path / "c.mcap", []
    with open_threshold(curve(), log, min_iti_s=0) as session:
        for number in range(5):
            asked.append(session.ask())
            if number == 2:
                session.lost("the coil moved")
            else:
                session.tell(mep_mv(asked[-1]))
    resumed = resume_threshold(log)
    with resumed as session:
        while not session.decision().stop:
            asked.append(session.ask())
            session.tell(mep_mv(asked[-1]))
    uninterrupted = asked_of(curve())
    assert asked == [*uninterrupted[:3], *uninterrupted[2:]]
    trials = given_pulses([read_threshold(log)])
    assert Counter(trial.counts for trial in trials) == {True: 12, False: 1}


def test_pulses_over_a_curve_are_shares_of_the_threshold_that_was_sought_before(tmp_path: Path) -> None:
    for name, search in (("t", make_threshold_search("bayes", SPACE)), ("c", curve())):
        with open_threshold(search, tmp_path / f"{name}.mcap", min_iti_s=0) as session:
            while not session.decision().stop:
                session.tell(mep_mv(session.ask()))
    sought, over = (read_threshold(tmp_path / f"{name}.mcap") for name in "tc")
    threshold = search_of(sought).estimate().threshold_pct_mso
    assert threshold is not None
    trials = given_pulses([sought, over])[sought.given :]
    assert {trial.intensity_pct_rmt for trial in trials} == {round(100 * at / threshold, 2) for at in AT}
    assert {trial.intensity_pct_rmt for trial in given_pulses([over])} != {trial.intensity_pct_rmt for trial in trials}
