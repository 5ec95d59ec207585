"""A loop of the lab's own that reports wrong ISIs: they do not count, also after resuming, until they are confirmed."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from isiw.design import DesignSpace
from isiw.devices.clock import VirtualClock
from isiw.errors import ImplausibleDataWarning, InvalidValueError
from isiw.findings import Kind
from isiw.log.record import SessionRecord, read_session
from isiw.plots import session_figure
from isiw.report import final_statement
from isiw.session.afterwards import estimate_again, exclude
from isiw.session.recorder import Recorder
from isiw.session.resuming import open_session
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.strategy import Strategy
from isiw.summary import IN_DOUBT

SPACE = DesignSpace(20, 320, reference="impact")


@pytest.fixture(autouse=True)
def doubts() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImplausibleDataWarning)
        yield


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "own.mcap"


def a_strategy() -> Strategy:
    return make_strategy("random", space=SPACE, seed=1, particles=20, max_trials=30)


def opened(log: Path) -> Recorder:
    return open_session(a_strategy(), log, resume=True, clock=VirtualClock())


def mep_mv(isi_ms: float) -> float:
    return 0.4 + isi_ms / 1e4 if 80 < isi_ms < 160 else 0.015 + isi_ms / 1e5


def told(session: Recorder, trials: int, wrong: Callable[[float], float] = lambda isi_ms: isi_ms) -> None:
    for _ in range(trials):
        asked_ms = session.ask()
        session.tell(wrong(asked_ms), mep_mv(asked_ms))


def told_until_refused(session: Recorder) -> tuple[int, ...]:
    """The trials in doubt by which an outcome is refused; its trial stays open."""
    told(session, 4)
    with pytest.raises(InvalidValueError, match="confirm=True") as caught:
        told(session, 20, lambda isi_ms: isi_ms / 2)
    assert caught.value.found is Kind.ISIS_FAR
    return session.in_doubt


def says_nothing(record: SessionRecord) -> bool:
    """Whether a log says in every way that nothing is said about a window."""
    profile = session_figure(record).axes[0]
    return (
        record.found is None
        and f"{IN_DOUBT}" in str(record)
        and f"{IN_DOUBT}" in final_statement(record)
        and "in doubt" in profile.get_title("left")
        and ["in doubt" in text.get_text() for text in profile.texts] == [True]
    )


def test_trials_in_doubt_do_not_count_and_no_window_is_stated(log: Path) -> None:
    with opened(log) as session:
        doubted = told_until_refused(session)
        assert 3 <= len(doubted) <= 5
        assert min(doubted) >= 4
        assert session.estimate().window is None
        assert session.estimate().too_little == session.decision().reason == f"{IN_DOUBT}"
        assert session.asked is not None
        assert len(session.trials.told) == len(session.trials) - len(doubted)
    record = read_session(log)
    assert says_nothing(record)
    assert record.estimates[-1].segments_ms == ()
    assert [event.trial for event in record.events if event.kind == "exclusion"] == [*doubted]


def test_the_doubt_is_said_once_and_logged(log: Path) -> None:
    said: list[str] = []
    with open_session(a_strategy(), log, clock=VirtualClock(), on_doubt=said.append) as session:
        told_until_refused(session)
    assert said.count(f"{IN_DOUBT}") == 1
    assert [event.finding for event in read_session(log).events if event.kind == "doubt"].count(Kind.ISIS_FAR) == 1


def test_resuming_restores_the_doubt_and_a_confirmation(log: Path) -> None:
    with opened(log) as session:
        doubted = told_until_refused(session)
    with opened(log) as session:
        assert session.in_doubt == doubted
        assert session.estimate().window is None
        asked_ms = session.ask()
        with pytest.raises(InvalidValueError, match="confirm=True"):
            session.tell(asked_ms, 0.1)
        session.tell(asked_ms / 2, 0.1, confirm=True)
        assert session.in_doubt == ()
        told(session, 4, lambda isi_ms: isi_ms / 2)
        probability = session.estimate().probability
    with opened(log) as session:
        assert session.in_doubt == ()
        assert session.estimate().probability == probability
        told(session, 4, lambda isi_ms: isi_ms / 2)
        assert len(session.trials.told) == len(session.trials) - 1  # of that one, nobody knows the outcome


def test_who_excludes_the_wrong_trials_continues_and_is_asked_again_at_the_next_fault(log: Path) -> None:
    with opened(log) as session:
        doubted = told_until_refused(session)
        for number in doubted:
            session.exclude(number, "the loop reported half of it")
        assert session.in_doubt == ()
        assert session.asked is not None
        session.tell(session.asked.isi_ms, 0.1)
        told(session, 3)
        assert session.estimate().rests_on_data
        with pytest.raises(InvalidValueError, match="confirm=True"):
            told(session, 20, lambda isi_ms: isi_ms / 2)


def test_trials_in_doubt_can_be_excluded_when_no_session_is_open(log: Path) -> None:
    with opened(log) as session:
        doubted = told_until_refused(session)
    estimate_again(log)
    assert says_nothing(read_session(log))
    for number in doubted:
        exclude(log, number, "the loop reported half of it")
    estimate_again(log)
    assert read_session(log).found is not None
    with opened(log) as session:
        told(session, 1)


def test_a_mistrial_and_tms_alone_need_no_confirmation(log: Path) -> None:
    with opened(log) as session:
        told_until_refused(session)
        session.mistrial("no impact")
        session.tell(None, 0.02)
        assert session.in_doubt


def test_a_doubt_that_a_crash_cut_off_is_raised_at_the_next_trial(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as crash, opened(log) as session:
        crash.setattr("isiw.session.recorder.newly_doubted", lambda *_: [])
        told(session, 4, lambda isi_ms: isi_ms / 2)
    with opened(log) as session:
        told(session, 1)
        assert len(session.in_doubt) >= 3
