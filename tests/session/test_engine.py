"""The compiled engine is there before a device is armed, or nothing is begun."""

from __future__ import annotations

from pathlib import Path

import pytest

from isiw.errors import IsiwError
from isiw.native import engine
from isiw.session.loop import Session
from scripted import ScriptedDevice, scripted_strategy


def test_without_an_engine_for_this_processor_nothing_is_armed_and_no_log_begins(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine.level.cache_clear()
    monkeypatch.setattr(engine, "_found", lambda _: None)
    device = ScriptedDevice()
    with pytest.raises(IsiwError, match="isiw was not compiled for this processor"):
        Session(device, scripted_strategy(2), log=log).run(progress=False)
    assert "stage" not in device.calls
    assert not list(log.parent.iterdir())
