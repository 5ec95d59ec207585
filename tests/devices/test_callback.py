"""A device made of plain functions."""

from __future__ import annotations

import pytest

from isiw.devices.info import DeviceInfo
from isiw.devices.protocol import CallbackDevice
from isiw.errors import DeviceError
from isiw.sweeps import Measurement
from isiw.trials import Stimulus


class Rig:
    """Remembers what it was told to do."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.device = CallbackDevice(
            self.fire,
            DeviceInfo("rig", "impact"),
            lambda: self.calls.append("arm"),
            lambda: self.calls.append("disarm"),
        )

    def fire(self, stimulus: Stimulus, timeout_s: float) -> Measurement:
        self.calls.append(f"fire {stimulus.isi_ms:g} within {timeout_s:g} s")
        return Measurement(0.1, stimulus.isi_ms)


def test_the_functions_are_called_when_their_verbs_are() -> None:
    rig = Rig()
    rig.device.stage()
    assert rig.device.deliver(Stimulus(0, 50.0), 2.0) == Measurement(0.1, 50.0)
    rig.device.stop()
    rig.device.unstage()
    assert rig.calls == ["arm", "fire 50 within 2 s", "disarm", "disarm"]


def test_nothing_fires_before_it_is_armed_or_after_it_was_stopped() -> None:
    rig = Rig()
    with pytest.raises(DeviceError):
        rig.device.deliver(Stimulus(0, 50.0), 2.0)
    rig.device.stage()
    rig.device.stop()
    with pytest.raises(DeviceError):
        rig.device.deliver(Stimulus(0, 50.0), 2.0)
    assert rig.calls == ["arm", "disarm"]


def test_a_device_that_cannot_be_armed_fires_nothing() -> None:
    def refuse() -> None:
        raise DeviceError("no air")

    device = CallbackDevice(Rig().fire, DeviceInfo("rig", "impact"), arm=refuse)
    with pytest.raises(DeviceError, match="no air"):
        device.stage()
    with pytest.raises(DeviceError):
        device.deliver(Stimulus(0, 50.0), 2.0)
