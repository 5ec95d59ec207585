from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from isiw.devices.limits import Limits
from isiw.log.record import SessionRecord, read_session
from isiw.report.tables import first_facts, further_facts, settings_facts
from isiw.session.loop import Session
from isiw.visit import Visit
from scripted import ScriptedDevice, scripted_strategy


@pytest.fixture
def record(tmp_path: Path) -> SessionRecord:
    limits = Limits(
        0, 200, min_iti_s=6.0, max_pulses=50, max_block_pulses=20, rest_s=90, max_coil_c=None, max_period_pulses=100
    )
    Session(
        ScriptedDevice(),
        scripted_strategy(2, seed=7),
        log=tmp_path / "s.mcap",
        limits=limits,
        subject="P07",
        visit=Visit(day=2, operator="MK", muscle="FCR"),
    ).run()
    return read_session(tmp_path / "s.mcap")


def test_subject_date_device_limits_seed_and_version_come_first(record: SessionRecord) -> None:
    facts = dict(first_facts(record))
    assert list(facts) == ["subject", "date", "device", "limits", "strategy", "version"]
    assert facts["subject"] == "P07, day 2, operator MK"
    assert facts["date"] == record.header.created.replace("T", " ").replace("+00:00", " UTC")
    assert facts["device"] == "scripted, simulated: nobody was stimulated"
    assert facts["limits"] == (
        "ISIs of 0–200 ms, at most 50 stimuli, at least 6 s apart, a pause after 3 mistrials in a row, "
        "a rest of 90 s after 20 stimuli, at most 100 in 3600 s"
    )
    assert facts["strategy"] == "of own objects, seed 7"
    assert facts["version"].startswith(f"isiw {record.header.isiw_version} (python ")


def test_the_highest_intensity_that_was_allowed_is_among_the_limits(record: SessionRecord) -> None:
    limits = replace(record.header.limits, max_intensity_pct_rmt=120.0)
    header = record.header.model_copy(update={"limits": limits})
    assert dict(first_facts(replace(record, header=header)))["limits"].endswith(", no intensity above 120 % RMT")


def test_a_subject_of_several_lines_cannot_pass_for_other_facts(record: SessionRecord) -> None:
    header = record.header.model_copy(update={"subject": "P07\nlimits:   none"})
    assert first_facts(replace(record, header=header))[0].value.startswith("P07 limits: none, day 2")


def test_the_rest_of_the_header_is_told_in_its_own_words(record: SessionRecord) -> None:
    facts = dict(further_facts(record))
    assert facts["visit"] == "day 2, operator MK, muscle FCR"
    assert facts["judgement of a sweep"] == "mep_window_ms 15–35, background_uv 10"
    assert facts["log"] == f"s.mcap, schema {record.header.schema_version}"


def test_settings_have_the_keys_of_a_configuration(record: SessionRecord) -> None:
    settings = {"max_trials": 9, "prior": {"noise": {"missing": 0.1}}, "acquisition": "gölden"}
    recipe = record.header.strategy.model_copy(update={"settings": settings})
    header = record.header.model_copy(update={"strategy": recipe})
    assert settings_facts(replace(record, header=header)) == [
        ("max_trials", "9"), ("prior.noise.missing", "0.1"), ("acquisition", '"gölden"'),
    ]  # fmt: skip
