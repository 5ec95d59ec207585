"""Plans that the limits do not hold are refused before anything is delivered."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.errors import InvalidValueError
from isiw.intervention import Arm, Plan
from isiw.pairing.agenda import Agenda
from isiw.pairing.fitting import require_possible, require_settable
from isiw.trials import Status, Trial
from pairing.paired import LIMITS, device, intervention, knowing, planned, session


def test_a_plan_beyond_the_limit_is_refused_with_its_sum_and_no_log_is_made(tmp_path: Path) -> None:
    refused = session(tmp_path / "s.mcap", limits=dataclasses.replace(LIMITS, max_pulses=58))
    with pytest.raises(InvalidValueError, match=r"3 before the pairs \+ 50 pairs \+ 2 × 3 after = 59"):
        refused.run()
    assert not list(tmp_path.iterdir())


def test_the_default_limit_is_never_raised(tmp_path: Path) -> None:
    usual = Limits.of_space(session(tmp_path / "s.mcap").header.space)
    with pytest.raises(InvalidValueError, match="max_pulses = 200"):
        require_possible(Plan("2026-17"), usual, 1, 0)
    require_possible(Plan("2026-17"), usual.stated(5.0), 0, 0)


@pytest.mark.parametrize(
    ("limits", "plan", "says"),
    [
        ({"max_block_pulses": 10, "rest_s": 120.0}, {}, "do not allow the times"),
        ({"max_period_pulses": 20, "period_s": 3600.0}, {}, "do not allow the times"),
        ({"min_iti_s": 8.0}, {"rest_s": 60.0}, "do not allow the times"),
        ({}, {"after": 20, "after_min": (0.0, 1.0)}, "not over when the block after 1 min"),
        ({}, {"range_ms": (50.0, 250.0)}, "beyond the limits"),
    ],
)
def test_a_plan_whose_times_or_isis_the_limits_do_not_allow_is_refused(
    limits: dict[str, Any], plan: dict[str, Any], says: str
) -> None:
    with pytest.raises(InvalidValueError, match=says):
        require_possible(planned(**plan), dataclasses.replace(LIMITS, **limits), 0, 0)


def test_intensities_that_nobody_can_set_are_refused(tmp_path: Path) -> None:
    several = planned(intensities_pct_rmt=(100.0, 120.0))
    with pytest.raises(InvalidValueError, match="the device is simulated"):
        require_settable(several, LIMITS, DeviceInfo("a robot", "valve", simulated=True, tap_alone=True))
    rig = DeviceInfo("rig", "valve", tap_alone=True)
    with pytest.raises(InvalidValueError, match="the limits, or what the device reports, allow one"):
        require_settable(several, dataclasses.replace(LIMITS, intensity_pct_mso=50.0), rig)
    require_settable(several, LIMITS, rig)
    refused = session(tmp_path / "s.mcap", intervention(intensities_pct_rmt=(100.0, 120.0)))
    with pytest.raises(InvalidValueError, match="cannot be set"):
        refused.run()


def test_a_plan_that_rests_as_the_limits_ask_is_allowed() -> None:
    limits = dataclasses.replace(LIMITS, max_block_pulses=23, rest_s=60.0)
    require_possible(planned(after_min=(10.0,)), limits, 0, 0)
    require_possible(intervention().plan, LIMITS, 0, 0)


def test_an_arm_that_the_device_cannot_give_is_refused_whichever_is_drawn(tmp_path: Path) -> None:
    rig = device()
    rig.info = dataclasses.replace(rig.info, tap_alone=False)
    refused = session(tmp_path / "s.mcap", intervention(Arm.WINDOW), rig)
    with pytest.raises(InvalidValueError, match="an arm of taps alone"):
        refused.run()
    assert not list(tmp_path.iterdir())


def test_intensities_of_a_plan_keep_to_the_highest_and_exclude_those_that_the_device_sets() -> None:
    several, rig = planned(intensities_pct_rmt=(100.0, 120.0)), DeviceInfo("rig", "valve", tap_alone=True)
    highest = dataclasses.replace(LIMITS, max_intensity_pct_rmt=110.0)
    with pytest.raises(InvalidValueError, match="at most 110 % RMT"):
        require_settable(several, highest, rig)
    with pytest.raises(InvalidValueError, match="are set by hand"):
        require_settable(several, LIMITS, rig, searched_several=True)


def test_pairs_outside_the_window_keep_to_the_range_of_the_plan() -> None:
    within = Agenda(intervention(Arm.OUTSIDE, range_ms=(20.0, 120.0)), knowing(), 0)
    trials = [Trial(number, Status.ACCEPTED, None, mep_mv=0.2) for number in range(3)]
    for number in range(3, 53):
        isi_ms = within.isi_ms(trials)
        assert 20.0 <= isi_ms < 70.0
        trials.append(Trial(number, Status.ACCEPTED, isi_ms, isi_ms=isi_ms, mep_mv=0.2))
    with pytest.raises(InvalidValueError, match="or range_ms"):
        Agenda(intervention(Arm.OUTSIDE, range_ms=(80.0, 120.0)), knowing(), 0)
