from __future__ import annotations

import subprocess
import sys

import pytest

import isiw


@pytest.mark.parametrize("name", ["__version__", *dir(isiw)])
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(isiw, name) is not None


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="windwo"):
        getattr(isiw, "windwo")  # noqa: B009 - mypy knows that there is none


def test_the_surface_that_lab_software_relies_on_is_pinned() -> None:
    assert {
        "CallbackDevice", "DesignSpace", "Device", "DeviceInfo", "Limits", "Measurement", "Session", "Stimulus",
        "StopDecision", "Sweep", "Trial", "TrialTable", "VirtualClock", "Window", "WindowEstimate", "errors",
        "exclude", "list_strategies", "make_strategy", "metrics", "read_session", "resume", "signals", "subjects",
        "testing",
    } <= set(dir(isiw))  # fmt: skip


def test_importing_isiw_loads_nothing_heavy() -> None:
    heavy = "{'torch', 'numpy', 'pandas', 'matplotlib', 'scipy', 'pydantic'}"
    subprocess.run([sys.executable, "-c", f"import sys, isiw; assert not {heavy} & set(sys.modules)"], check=True)  # noqa: S603
