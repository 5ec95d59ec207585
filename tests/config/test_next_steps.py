"""What to type next: after a session that an error has ended."""

from __future__ import annotations

from pathlib import Path

import pytest

from isiw.config.resume import after_error
from isiw.errors import LogError
from isiw.session.loop import Session
from scripted import ScriptedDevice, scripted_strategy


def test_a_session_that_was_over_when_its_device_failed_is_not_to_be_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unstage() -> None:
        raise OSError("port gone")

    device = ScriptedDevice()
    monkeypatch.setattr(device, "unstage", unstage)
    session = Session(device, scripted_strategy(2), log=tmp_path / "s.mcap")
    with pytest.raises(OSError, match="port gone") as failed:
        session.run()
    (line,) = after_error(session, None, failed.value, delivered=True)
    assert line.startswith("The session is over, and its log is complete.")
    assert line.endswith(f"isiw show {tmp_path / 's.mcap'}")


def test_a_session_whose_last_decision_is_not_on_disk_is_to_be_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise LogError("the log cannot be written")

    session = Session(ScriptedDevice(), scripted_strategy(2), log=tmp_path / "s.mcap")
    monkeypatch.setattr("isiw.session.examination.estimate_record", full)
    with pytest.raises(LogError) as failed:
        session.run()
    assert "isiw resume" in after_error(session, None, failed.value, delivered=True)[-1]


def test_a_session_in_recorded_emg_goes_on_with_its_folder_named_again(tmp_path: Path) -> None:
    config = {"isiw_run": {"subject": {"kind": "recorded", "data": "elsewhere"}}}
    session = Session(ScriptedDevice(), scripted_strategy(2), log=tmp_path / "s.mcap", config=config)
    assert after_error(session, None, None, delivered=True)[-1].endswith("s.mcap --data DIR")
