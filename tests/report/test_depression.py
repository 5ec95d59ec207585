"""What a session says about ISIs that depress the MEP."""

from __future__ import annotations

from pathlib import Path

import pytest

from isiw.log.record import SessionRecord, read_session
from isiw.report.words import final_statement
from isiw.sentences import depression
from isiw.session.loop import Session
from isiw.sweeps import Measurement
from isiw.visit import Visit
from report.sessions import with_estimate
from scripted import ScriptedDevice, scripted_strategy

ALONE = "This strategy looks for enhancement alone. At 120 % of RMT the tap may depress the MEP too"


def session(folder: Path, intensity_pct_rmt: float | None) -> SessionRecord:
    device = ScriptedDevice(lambda s: Measurement(0.0512, s.isi_ms))
    visit = Visit(intensity_pct_rmt=intensity_pct_rmt)
    Session(device, scripted_strategy(3), log=folder / "s.mcap", visit=visit).run()
    return read_session(folder / "s.mcap")


def test_above_the_threshold_it_says_that_only_enhancement_was_looked_for(tmp_path: Path) -> None:
    assert ALONE in final_statement(session(tmp_path, 120.0))


@pytest.mark.parametrize("intensity_pct_rmt", [None, 90.0, 100.0])
def test_below_the_threshold_it_says_nothing_of_depression(tmp_path: Path, intensity_pct_rmt: float | None) -> None:
    assert depression(session(tmp_path, intensity_pct_rmt).estimates[-1], "tap", intensity_pct_rmt) == ""


@pytest.mark.parametrize(("probability", "depresses"), [(0.87, "probably depresses"), (0.96, "depresses")])
def test_what_was_found_depressed_is_said_with_its_probability(
    tmp_path: Path, probability: float, depresses: str
) -> None:
    record = with_estimate(session(tmp_path, 120.0), depressed_ms=(10.0, 35.0), depressed_probability=probability)
    said = f"The tap {depresses} the MEP at ISIs of 10–35 ms (probability that it does so anywhere: {probability})."
    assert said in final_statement(record)
    assert ALONE not in final_statement(record)


def test_that_nothing_was_found_depressed_is_said(tmp_path: Path) -> None:
    record = with_estimate(session(tmp_path, 120.0), depressed_probability=0.03)
    said = "No ISIs were found at which the tap depresses the MEP (probability that it does so anywhere: 0.03)."
    assert said in final_statement(record)
    open_still = with_estimate(record, depressed_probability=0.13)
    assert "It is undecided whether the tap depresses the MEP at any ISI" in final_statement(open_still)
