from __future__ import annotations

import pytest

from isiw.devices.replay import ReplayDevice
from isiw.errors import DeviceError
from isiw.trials import MistrialReason, Status, Stimulus, Trial, TrialTable

TABLE = TrialTable(
    (
        Trial(0, Status.ACCEPTED, 10.0, isi_ms=11.0, mep_mv=0.01),
        Trial(1, Status.MISTRIAL, 10.0, MistrialReason.NO_IMPACT),
        Trial(2, Status.ACCEPTED, 50.0, isi_ms=49.0, mep_mv=0.05),
        Trial(3, Status.ACCEPTED, 50.0, isi_ms=51.0, mep_mv=0.06, excluded=True),
        Trial(4, Status.ACCEPTED, 50.0, isi_ms=52.0, mep_mv=0.07),
        Trial(5, Status.ACCEPTED, None, mep_mv=0.02),
    )
)


@pytest.fixture
def device():
    replay = ReplayDevice(TABLE, "impact")
    replay.stage()
    return replay


def meps(device, *isis):
    return [device.deliver(Stimulus(trial, isi), 1.0).mep_mv for trial, isi in enumerate(isis)]


def test_the_same_asks_get_the_same_answers_in_order(device):
    assert meps(device, 10.0, 50.0, 50.0) == [0.01, 0.05, 0.07]


def test_another_ask_gets_the_nearest_trial_at_its_own_isi(device):
    assert device.deliver(Stimulus(0, 35.0), 1.0).isi_ms == 49.0


def test_tms_alone_is_answered_by_tms_alone(device):
    assert meps(device, None) == [0.02]


def test_each_trial_answers_once(device):
    meps(device, 10.0, 50.0, 50.0)
    with pytest.raises(DeviceError, match="no recorded trial is left"):
        device.deliver(Stimulus(3, 50.0), 1.0)
