from __future__ import annotations

from pathlib import Path

import pytest

from isiw.design import DesignSpace
from isiw.devices.limits import Limits
from isiw.devices.protocol import Readiness
from isiw.devices.simulated import DryRun
from isiw.errors import LimitExceededError
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.testing import check_device
from scripted import ScriptedDevice, scripted_strategy


def test_a_rehearsal_arms_and_fires_nothing(tmp_path: Path) -> None:
    device = ScriptedDevice(simulated=False)
    result = Session(DryRun(device), scripted_strategy(4), log=tmp_path / "s.mcap").run()
    assert device.delivered == []
    assert device.calls == []
    assert {trial.mep_mv for trial in result.trials} == {0.0}
    assert read_session(tmp_path / "s.mcap").header.device.name == "dry run of scripted"


def test_a_rehearsal_keeps_the_limits_on_what_the_device_reports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = ScriptedDevice(simulated=False)
    monkeypatch.setattr(device, "readiness", lambda: Readiness(coil_c=50.0), raising=False)
    session = Session(
        DryRun(device), scripted_strategy(4), log=tmp_path / "s.mcap", limits=Limits(0, 200, max_coil_c=40.0)
    )
    with pytest.raises(LimitExceededError, match="50 °C"):
        session.run()


def test_a_rehearsal_is_a_device(space: DesignSpace) -> None:
    check_device(lambda: DryRun(ScriptedDevice(simulated=False)), space)
