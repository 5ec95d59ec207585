"""Pulses of searches for the motor threshold, as what they are to a session."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest

from isiw.errors import InvalidValueError
from isiw.session import open_threshold, read_threshold, resume_threshold
from isiw.session.given import given_pulses
from isiw.session.threshold import search_of
from isiw.strategy.threshold import IntensityRange, make_threshold_search

SPACE = IntensityRange(20, 80)


def search(log: Path, method: str = "bayes", pulses: int = 6, *, seen: bool = False) -> Path:
    """The log of a search in which MEPs begin at 50 % MSO; the second pulse is lost."""
    settings = {"max_pulses": 30} if method == "bayes" else {}
    with open_threshold(make_threshold_search(method, SPACE, **settings), log, min_iti_s=0, muscle="FCR") as session:
        for number in range(pulses):
            asked = session.ask()
            mep_mv = 0.01 if asked < 50 else 0.05 * (asked - 48)
            if number == 1:
                session.lost("the coil moved")
            elif seen:
                session.tell(response=asked >= 50)
            else:
                session.tell(mep_mv)
        if method == "bayes":
            session.ask()  # which nobody answers
    return log


def test_each_pulse_is_tms_alone_at_its_share_of_the_threshold_that_was_found(tmp_path: Path) -> None:
    record = read_threshold(search(tmp_path / "t.mcap"))
    threshold = record_threshold(record.path)
    trials = given_pulses([record])
    assert len(trials) == record.given == 7
    assert [trial.counts for trial in trials] == [True, False, True, True, True, True, False]
    assert len({trial.index for trial in trials}) == 7
    for trial, outcome in zip(trials, record.outcomes, strict=False):
        if trial.counts:
            assert outcome.intensity_pct_mso is not None
            assert trial.intensity_pct_rmt == pytest.approx(100 * outcome.intensity_pct_mso / threshold, abs=0.01)
            assert (trial.mep_mv, trial.isi_ms, trial.commanded_isi_ms) == (outcome.mep_mv, None, None)


def record_threshold(log: Path) -> float:
    threshold = search_of(read_threshold(log)).estimate().threshold_pct_mso
    assert threshold is not None
    return threshold


def test_a_response_that_was_seen_is_an_amplitude_above_fifty_microvolts(tmp_path: Path) -> None:
    trials = given_pulses([read_threshold(search(tmp_path / "t.mcap", pulses=12, seen=True))])
    intervals = {trial.mep_interval_mv for trial in trials if trial.counts}
    assert intervals == {(0.0, 0.05), (0.05, math.inf)}


def test_a_search_without_a_threshold_takes_that_of_the_one_before(tmp_path: Path) -> None:
    whole, short = search(tmp_path / "a.mcap"), search(tmp_path / "b.mcap", pulses=1)
    both = given_pulses([read_threshold(whole), read_threshold(short)])
    assert len(both) == 9
    assert len({trial.index for trial in both}) == 9
    with pytest.raises(InvalidValueError, match=r"shares of no known threshold.*Continue it"):
        given_pulses([read_threshold(short), read_threshold(whole)])


def test_no_search_counts_twice_whatever_was_excluded_in_a_copy(tmp_path: Path) -> None:
    log = search(tmp_path / "a.mcap")
    copy = Path(shutil.copy(log, tmp_path / "copy.mcap"))
    with resume_threshold(copy) as session:
        session.exclude(0, "the coil moved")
        session.ask()
        session.tell(0.1)
    for logs in ((log, log), (log, copy)):
        with pytest.raises(InvalidValueError, match="of the same search"):
            given_pulses([read_threshold(each) for each in logs])


def test_pulses_at_many_places_are_no_recruitment_curve(tmp_path: Path) -> None:
    spot = search(tmp_path / "spot.mcap", "hot-spot", pulses=3)
    with pytest.raises(InvalidValueError, match="many places"):
        given_pulses([read_threshold(spot)])
