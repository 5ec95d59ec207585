"""Going on with a logged session and a configuration: what holds from there on, and what is said about it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from isiw.config import load_config
from isiw.config.resume import changes_on_resume, differences_on_resume
from isiw.devices.protocol import Readiness
from isiw.log.record import SessionRecord, read_session
from isiw.session.loop import Session
from isiw.session.resuming import open_session
from scripted import SPACE, ScriptedDevice, scripted_strategy


@pytest.fixture
def own_loop(tmp_path: Path) -> SessionRecord:
    """The log of a lab's own loop, without limits that anybody stated."""
    with open_session(scripted_strategy(10), tmp_path / "own.mcap") as session:
        session.tell(session.ask(), 0.02)
    return read_session(tmp_path / "own.mcap")


@pytest.fixture
def config(tmp_path: Path) -> Any:
    """Makes the configuration of a rig, with what is written in it besides."""

    def made(text: str = "") -> Any:
        file = tmp_path / "s.toml"
        space = f"[space]\nlow_ms = {SPACE.low_ms}\nhigh_ms = {SPACE.high_ms}\nreference = 'valve'\n"
        file.write_text(f'[device]\nfactory = "rig:make"\n{space}{text}')
        return load_config(file)

    return made


def test_the_interval_that_a_device_gets_where_it_takes_over_a_loop_of_the_labs_own_is_said(
    config: Any, own_loop: SessionRecord
) -> None:
    assert changes_on_resume(config(), own_loop) == {}
    assert differences_on_resume(config(), own_loop) == ("limits.min_iti_s is 5.0 from here on; it was 0.0.",)


def test_an_interval_that_the_configuration_states_holds(config: Any, own_loop: SessionRecord) -> None:
    stated = config("[limits]\nmin_iti_s = 2.0\n")
    assert changes_on_resume(stated, own_loop)["limits"].min_iti_s == 2.0
    assert differences_on_resume(stated, own_loop) == ("limits.min_iti_s is 2.0 from here on; it was 0.0.",)


@pytest.fixture
def locked(tmp_path: Path) -> SessionRecord:
    """The log of a session that is bound to the intensity that its device reported."""

    class Stimulator(ScriptedDevice):
        def readiness(self) -> Readiness:
            return Readiness(intensity_pct_mso=60.0)

    Session(Stimulator(), scripted_strategy(2), log=tmp_path / "s.mcap").run()
    return read_session(tmp_path / "s.mcap")


def test_the_intensity_that_a_session_began_with_stays_where_the_configuration_names_none(
    config: Any, locked: SessionRecord
) -> None:
    said = config("[limits]\nmax_pulses = 50\n")
    limits = changes_on_resume(said, locked)["limits"]
    assert (limits.max_pulses, limits.intensity_pct_mso) == (50, 60.0)
    assert differences_on_resume(said, locked) == ("limits.max_pulses is 50 from here on; it was 200.",)


def test_the_intensity_that_the_configuration_names_holds(config: Any, locked: SessionRecord) -> None:
    said = config("[limits]\nintensity_pct_mso = 65.0\n")
    assert changes_on_resume(said, locked)["limits"].intensity_pct_mso == 65.0
    assert differences_on_resume(said, locked) == ("limits.intensity_pct_mso is 65.0 from here on; it was 60.0.",)
