"""What a session is not begun with: values, parts and places that cannot be meant."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest

from isiw.devices.deadlines import Deadlines
from isiw.errors import DeviceError, DeviceTimeoutError, InvalidValueError, LogError
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.session.resuming import open_session
from isiw.session.rig import Safeguards
from isiw.strategy.catalogue import make_strategy
from isiw.visit import Visit
from scripted import ScriptedDevice, scripted_strategy


@pytest.mark.parametrize(
    ("visit", "words"),
    [
        (Visit(intensity_pct_rmt=1.1), "the visit's intensity_pct_rmt is probably in another unit.*parts of 1"),
        (Visit(intensity_pct_mso=0.6), "the visit's intensity_pct_mso is probably in another unit.*parts of 1"),
        (Visit(intensity_pct_rmt=1100), "the visit's intensity_pct_rmt is probably in another unit.*3 to 300 %"),
        (Visit(intensity_pct_rmt=110.0), r"different intensities .*got '80 % of RMT in the strategy'; expected 110"),
    ],
)
def test_an_intensity_in_parts_of_one_or_one_that_contradicts_the_strategys_begins_nothing(
    log: Path, visit: Visit, words: str
) -> None:
    strategy, device = make_strategy(intensity_pct_rmt=80.0), ScriptedDevice()
    with pytest.raises(InvalidValueError, match=words):
        Session(device, strategy, log=log, visit=visit).run()
    with pytest.raises(InvalidValueError, match=words):
        open_session(strategy, log, visit=visit)
    assert (device.delivered, list(log.parent.iterdir())) == ([], [])


@pytest.mark.parametrize(
    ("device", "words"), [(ScriptedDevice, r"Make one: ScriptedDevice\(\)"), (object(), "has describe, stage")]
)
def test_what_is_no_device_begins_nothing_and_is_told_what_one_has(log: Path, device: Any, words: str) -> None:
    with pytest.raises(InvalidValueError, match=f"cannot use this device.*{words}"):
        Session(device, scripted_strategy(), log=log)
    assert list(log.parent.iterdir()) == []


@pytest.mark.parametrize("earlier", [[], [0.1, 0.2], "P07.mcap"])
def test_trials_of_before_are_refused_with_where_they_go(log: Path, earlier: Any) -> None:
    with pytest.raises(InvalidValueError, match=r"strategy\.learn_all"):
        Session(ScriptedDevice(), scripted_strategy(), log=log, earlier=earlier)
    with pytest.raises(InvalidValueError, match="resume must be"):
        open_session(scripted_strategy(), log, resume=earlier)


def test_a_session_that_was_never_armed_promises_no_log(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device, free = ScriptedDevice(), threading.Event()
    monkeypatch.setattr(device, "stage", lambda: free.wait(9.0))
    guards = Safeguards(deadlines=Deadlines(stage_s=0.05))
    with pytest.raises(DeviceTimeoutError, match="Check it, then start again; if the session has a log, resume it"):
        Session(device, scripted_strategy(), log=log, safeguards=guards).run()
    free.set()
    assert list(log.parent.iterdir()) == []


def test_a_description_that_is_none_is_refused_when_the_session_is_made(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = ScriptedDevice()
    monkeypatch.setattr(device, "describe", lambda: {"name": "rig"})
    with pytest.raises(DeviceError, match=r"describe\(\) did not return an isiw.DeviceInfo"):
        Session(device, scripted_strategy(), log=log)


@pytest.mark.parametrize("wrong", [{"dead_man": True}, {"on_pause": True}, {"retries": 10**9}])
def test_safeguards_that_cannot_be_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=f"Safeguards.{min(wrong)} must be"):
        Safeguards(**wrong)


def test_a_path_that_no_file_can_have_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a\0b.mcap"
    with pytest.raises(LogError, match="NUL"):
        Session(ScriptedDevice(), scripted_strategy(), log=path)
    with pytest.raises(LogError, match="NUL"):
        open_session(scripted_strategy(), path)
    with pytest.raises(LogError, match="NUL"):
        read_session(path)


def test_a_tap_alone_that_is_told_for_a_pair_is_named_in_the_refusal(log: Path) -> None:
    with open_session(scripted_strategy(9), log) as session:
        isi_ms = session.ask()
        words = f"got 'the outcome of a tap alone'; expected the outcome of a pair at {isi_ms:g} ms"
        with pytest.raises(InvalidValueError, match=words):
            session.tell(isi_ms, 0.1, pulse=False)


def test_a_visit_that_is_stated_on_resuming_agrees_with_the_strategy(log: Path) -> None:
    settings: dict[str, Any] = {"particles": 100, "intensity_pct_rmt": 80.0}
    open_session(make_strategy(**settings), log).close()
    with pytest.raises(InvalidValueError, match="different intensities"):
        open_session(make_strategy(**settings), log, resume=True, visit=Visit(intensity_pct_rmt=110.0))
    assert read_session(log).finished
