"""A session whose log is taken away while it runs."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from disks import HAPPENINGS
from isiw.devices.info import DeviceInfo
from isiw.errors import LogError
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.session.resuming import open_session, resume
from isiw.session.sink import SessionUpdate
from isiw.session.threshold import open_threshold, read_threshold
from isiw.strategy.threshold import IntensityRange, make_threshold_search
from isiw.sweeps import Measurement
from isiw.trials import Stimulus
from scripted import ScriptedDevice, scripted_strategy

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows does not let an open file be moved or deleted")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "folder" / "s.mcap"


def taking_away(log: Path, happening: str) -> ScriptedDevice:
    """A device during whose third delivery something happens to the log."""

    def answer(stimulus: Stimulus) -> Measurement:
        if stimulus.trial == 2:
            HAPPENINGS[happening](log.with_name("s.mcap.part"))
        return Measurement(0.1, stimulus.isi_ms)

    return ScriptedDevice(answer)


@pytest.mark.parametrize("happening", HAPPENINGS)
def test_a_log_that_is_gone_stops_the_session_before_the_next_stimulus(log: Path, happening: str) -> None:
    device = taking_away(log, happening)
    with pytest.raises(LogError, match="as it was written"):
        Session(device, scripted_strategy(9), log=log).run()
    assert len(device.delivered) == 3
    assert device.calls[-2:] == ["stop", "unstage"]


@pytest.mark.parametrize("happening", ["deleted", "moved", "its folder deleted", "its folder moved"])
def test_what_the_session_held_of_its_log_is_saved_and_can_be_resumed(log: Path, happening: str) -> None:
    with pytest.raises(LogError, match=r"s\.rescued\.mcap"):
        Session(taking_away(log, happening), scripted_strategy(9), log=log).run()
    saved = log.with_name("s.rescued.mcap")
    record = read_session(saved)
    assert record.finished
    assert record.losses == ()
    assert len(record.table) == 3
    assert "LogError" in record.events[-1].text
    assert len(resume(saved, ScriptedDevice(), scripted_strategy(9)).run().trials) == 9


def test_a_session_whose_log_was_shortened_is_resumed_from_what_was_written_from_memory(log: Path) -> None:
    def on_trial(update: SessionUpdate) -> None:
        if update.trial.index == 2:
            os.truncate(log.with_name("s.mcap.part"), 100)

    with pytest.raises(LogError, match="from memory"):
        Session(ScriptedDevice(), scripted_strategy(9), log=log, on_trial=on_trial).run()
    saved = log.with_name("s.rescued.mcap")
    assert len(read_session(saved).table) == 3
    assert len(resume(saved, ScriptedDevice(), scripted_strategy(9)).run().trials) == 9


def test_a_log_that_is_gone_after_the_last_stimulus_is_no_success(log: Path) -> None:
    def on_trial(update: SessionUpdate) -> None:
        if update.decision.stop:
            log.with_name("s.mcap.part").unlink()

    with pytest.raises(LogError, match=r"s\.rescued\.mcap"):
        Session(ScriptedDevice(), scripted_strategy(3), log=log, on_trial=on_trial).run()
    assert len(read_session(log.with_name("s.rescued.mcap")).table) == 3


@pytest.mark.parametrize("happening", HAPPENINGS)
def test_a_loop_of_the_labs_own_gets_no_further_isi_once_its_log_is_gone(log: Path, happening: str) -> None:
    def loop() -> None:
        with open_session(scripted_strategy(9), log) as session:
            session.tell(session.ask(), 0.1)
            HAPPENINGS[happening](log.with_name("s.mcap.part"))
            with pytest.raises(LogError, match="Nothing more is delivered"):
                session.ask()
            assert session.asked is None
            session.ask()

    with pytest.raises(LogError, match="as it was written"):
        loop()
    if happening in {"deleted", "moved"}:
        assert len(read_session(log.with_name("s.rescued.mcap")).table.told) == 1


def test_a_threshold_search_gets_no_further_intensity_once_its_log_is_gone(log: Path) -> None:
    search = make_threshold_search("maximum-likelihood", IntensityRange(20, 80))
    recorder = open_threshold(search, log, device=DeviceInfo("nobody", "impact", simulated=True))
    recorder.ask()
    recorder.tell(0.01)
    log.with_name("s.mcap.part").unlink()
    with pytest.raises(LogError, match="Nothing more is delivered"):
        recorder.ask()
    with pytest.raises(LogError, match=r"s\.rescued\.mcap"):
        recorder.close()


@pytest.mark.parametrize("happening", ["deleted", "shortened", "replaced"])
def test_what_was_asked_is_not_repeated_and_an_outcome_no_success_once_the_log_is_gone(
    log: Path, happening: str
) -> None:
    session = open_session(scripted_strategy(9), log)
    isi_ms = session.ask()
    HAPPENINGS[happening](log.with_name("s.mcap.part"))
    for call in (session.ask, lambda: session.tell(isi_ms, 0.1)):
        with pytest.raises(LogError, match="as it was written"):
            call()
    with pytest.raises(LogError, match=r"s\.rescued\.mcap"):
        session.close()
    assert [trial.mep_mv for trial in read_session(log.with_name("s.rescued.mcap")).table] == [0.1]


def test_an_intensity_is_not_repeated_and_its_outcome_no_success_once_the_log_is_gone(log: Path) -> None:
    device = DeviceInfo("nobody", "impact", simulated=True)
    search = open_threshold(make_threshold_search("bayes", IntensityRange(20, 80)), log, device=device)
    search.ask()
    log.with_name("s.mcap.part").unlink()
    for call in (search.ask, lambda: search.tell(0.2)):
        with pytest.raises(LogError, match="the file is gone"):
            call()
    with pytest.raises(LogError, match=r"s\.rescued\.mcap"):
        search.close()
    assert [outcome.mep_mv for outcome in read_threshold(log.with_name("s.rescued.mcap")).outcomes] == [0.2]


def test_what_was_asked_is_not_repeated_once_the_session_is_closed(log: Path) -> None:
    device = DeviceInfo("nobody", "impact", simulated=True)
    session = open_session(scripted_strategy(9), log)
    search = open_threshold(
        make_threshold_search("bayes", IntensityRange(20, 80)), log.with_name("t.mcap"), device=device
    )
    for recorder in (session, search):
        recorder.ask()
        recorder.close()
        with pytest.raises(LogError, match="the log is closed"):
            recorder.ask()
