"""Plans that the limits do not hold are refused before anything is delivered."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from isiw.devices.limits import Limits
from isiw.devices.protocol import DeviceInfo
from isiw.errors import InvalidValueError
from isiw.intervention import Plan
from isiw.pairing.fitting import require_possible, require_settable
from pairing.paired import LIMITS, intervention, planned, session


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
        require_settable(several, LIMITS, DeviceInfo("a robot", "valve", simulated=True))
    with pytest.raises(InvalidValueError, match="allows one alone"):
        require_settable(several, dataclasses.replace(LIMITS, intensity_pct_mso=50.0), DeviceInfo("rig", "valve"))
    require_settable(several, LIMITS, DeviceInfo("rig", "valve"))
    refused = session(tmp_path / "s.mcap", intervention(intensities_pct_rmt=(100.0, 120.0)))
    with pytest.raises(InvalidValueError, match="cannot be set"):
        refused.run()


def test_a_plan_that_rests_as_the_limits_ask_is_allowed() -> None:
    limits = dataclasses.replace(LIMITS, max_block_pulses=23, rest_s=60.0)
    require_possible(planned(after_min=(10.0,)), limits, 0, 0)
    require_possible(intervention().plan, LIMITS, 0, 0)
