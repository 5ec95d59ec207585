"""Pseudonymised exports: nothing in any file tells whose they are, and what is said to stay stays."""

from __future__ import annotations

import random
from pathlib import Path

import pandas as pd
import pytest

from export.recorded import note, sweep, write_sweeps
from isiw.devices.info import DeviceInfo
from isiw.export import export_logs
from isiw.export.collection import pseudonymised
from isiw.log.frames import trial_frame
from isiw.log.record import read_session

SECRETS = ("Meier", "Anna", "cough", "2026", "COM3", "ward 7", "meier_monday")


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Two days of one person, and one of another."""
    for name, subject, created in (
        ("meier_monday", "Meier", "2026-11-20T10:00:00+00:00"),
        ("meier_friday", "Meier", "2026-11-24T11:30:00+00:00"),
        ("other", "P08", "2026-11-21T10:00:00+00:00"),
    ):
        write_sweeps(
            tmp_path / "logs" / f"{name}.mcap",
            {0: sweep(0)},
            note("Meier has a cough"),
            subject=subject,
            created=created,
            config={"room": "ward 7"},
            device=DeviceInfo("bench", "impact", address="COM3"),
        )
    return tmp_path / "logs"


@pytest.mark.parametrize("to", ["csv", "parquet", "bids"])
def test_no_file_and_no_name_of_one_tells_whose_it_is(logs: Path, tmp_path: Path, to: str) -> None:
    export_logs(logs, tmp_path / "out", to, pseudonymise=True)
    files = [path for path in (tmp_path / "out").rglob("*") if path.is_file()]
    assert files
    for path in files:
        said = str(path.relative_to(tmp_path)).encode() + path.read_bytes()
        if path.suffix == ".parquet":
            said = pd.read_parquet(path).to_csv().encode()
        assert [secret for secret in SECRETS if secret.encode() in said] == [], path


def test_who_is_who_is_returned_and_kept_nowhere(logs: Path, tmp_path: Path) -> None:
    exported = export_logs(logs, tmp_path / "out", pseudonymise=True)
    assert set(exported.pseudonyms) == {"Meier", "P08"}
    assert set(exported.pseudonyms.values()) == {"001", "002"}
    sessions = pd.read_csv(tmp_path / "out" / "sessions.csv", dtype={"subject": str})
    assert sessions.subject.value_counts()[exported.pseudonyms["Meier"]] == 2


def test_days_between_visits_and_the_time_of_day_stay_and_dates_are_before_1925(logs: Path, tmp_path: Path) -> None:
    exported = export_logs(logs, tmp_path / "out", pseudonymise=True)
    sessions = pd.read_csv(tmp_path / "out" / "sessions.csv", dtype={"subject": str})
    own = pd.to_datetime(sessions.created[sessions.subject == exported.pseudonyms["Meier"]]).tolist()
    assert own[1] - own[0] == pd.Timedelta(days=4, hours=1, minutes=30)
    assert (own[0].hour, own[0].minute) == (10, 0)
    assert pd.to_datetime(sessions.created).dt.year.max() < 1925


def test_numbers_do_not_follow_the_order_of_codes_or_dates(logs: Path) -> None:
    records = [read_session(path) for path in sorted(logs.glob("*.mcap"))]
    found = {pseudonymised(records, random.Random(seed))[1]["Meier"] for seed in range(10)}  # noqa: S311 - a test
    assert found == {"001", "002"}


def test_the_trials_themselves_stay_as_they_are(logs: Path) -> None:
    record = read_session(logs / "other.mcap")
    ((changed,), _) = pseudonymised([record])
    was, now = (trial_frame(each).drop(columns="intent_utc") for each in (record, changed))
    assert now.equals(was)
    assert (changed.header.visit.muscle, changed.header.visit.day) == ("FCR", 2)


def test_sessions_without_a_code_are_different_people(tmp_path: Path) -> None:
    for hour, name in enumerate(("a", "b")):
        begun = f"2026-11-21T1{hour}:00:00+00:00"
        write_sweeps(tmp_path / "logs" / f"{name}.mcap", {0: {}}, subject="", created=begun)
    exported = export_logs(tmp_path / "logs", tmp_path / "out", pseudonymise=True)
    assert sorted(Path(name.rpartition(" ")[2]).name for name in exported.pseudonyms) == ["a.mcap", "b.mcap"]
    export_logs(tmp_path / "logs", tmp_path / "named")
    assert pd.read_csv(tmp_path / "named" / "trials.csv").subject.tolist() == ["unnamed1", "unnamed2"]
    write_sweeps(tmp_path / "logs" / "c.mcap", {0: {}}, subject="unnamed1", created="2026-11-21T13:00:00+00:00")
    export_logs(tmp_path / "logs", tmp_path / "three")
    three = pd.read_csv(tmp_path / "three" / "trials.csv").subject
    assert sorted(three) == ["unnamed1", "unnamed2", "unnamed3"]


def test_a_log_that_cannot_be_read_is_not_named(logs: Path, tmp_path: Path) -> None:
    (logs / "meier_tuesday.mcap").write_bytes(b"")
    exported = export_logs(logs, tmp_path / "out", pseudonymise=True)
    assert exported.lacking == ("Logs that are left out, as they cannot be read or are copies: 1.",)
