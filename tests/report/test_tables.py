from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from isiw.findings import Kind
from isiw.log.record import SessionRecord, read_session
from isiw.log.records import Onset
from isiw.log.schema import Event, Intent, Record
from isiw.report.tables import counted_rows, event_rows, lost_rows, trial_row
from isiw.session.afterwards import exclude
from isiw.session.loop import Session
from isiw.sweeps import Measurement
from isiw.trials import Status, Trial
from scripted import ScriptedDevice, scripted_strategy


@pytest.fixture
def record(tmp_path: Path) -> SessionRecord:
    device = ScriptedDevice(
        lambda s: Measurement(0.0512, s.isi_ms, background_rms_uv=50.0 if s.trial in {1, 2} else 2.0)
    )
    Session(device, scripted_strategy(6), log=tmp_path / "s.mcap").run()
    exclude(tmp_path / "s.mcap", 4, "sneezed")
    return read_session(tmp_path / "s.mcap")


def counted(record: SessionRecord) -> dict[str, tuple[str, str]]:
    return {row.what: (row.found, row.limit) for row in counted_rows(record)}


def test_a_trial_is_told_with_what_was_asked_realised_and_measured() -> None:
    trial = Trial(3, Status.ACCEPTED, 50.0, isi_ms=51.26, mep_mv=0.0512, background_rms_uv=2.04)
    assert trial_row(trial) == (3, "50 ms", "51.3 ms", "51 µV", "–", "2 µV", "")
    lost = Trial(4, Status.MISTRIAL, 50.0, Kind.BACKGROUND_ACTIVITY, mep_mv=0.07)
    assert trial_row(lost)[3:] == ("mistrial: background activity", "–", "–", "70 µV were measured")
    assert trial_row(lost.accepted_anyway()).remark == "accepted by the operator; had been: background activity"


def test_what_does_not_count_is_listed_with_its_reason(record: SessionRecord) -> None:
    reasons = {number: why for number, _, why in lost_rows(record)}
    assert reasons == {1: "background activity", 2: "background activity", 4: "excluded by the operator: sneezed"}


def test_a_stimulus_whose_trial_is_missing_is_lost_too(record: SessionRecord) -> None:
    history = (*record.history, Intent(trial=6, isi_ms=70.0, t_s=200.0))
    assert lost_rows(replace(record, history=history))[-1] == (6, "70 ms", "outcome unknown")


def test_events_are_listed_in_the_order_of_the_log(record: SessionRecord) -> None:
    assert [row[:2] for row in event_rows(record)] == [("5", "doubt"), ("4", "exclusion")]
    assert event_rows(record)[-1] == ("4", "exclusion", "sneezed")


def test_what_was_delivered_stands_beside_what_may_be(record: SessionRecord) -> None:
    told = counted(record)
    assert told["stimuli delivered"] == ("6", f"at most {record.header.limits.max_pulses}")
    assert told["most mistrials in a row"] == ("2", "a pause after 3")
    assert told["shortest time between two stimuli"] == ("5.00 s", "at least 5 s")
    assert told["of them with an unknown outcome"] == ("0", "")


def test_the_sessions_clock_says_nothing_across_a_resumption_nor_of_what_was_refused(record: SessionRecord) -> None:
    after: list[Record] = [
        Event(kind="resume", trial=5, text=""),
        Intent(trial=6, isi_ms=1.0, t_s=26.0),
        Event(kind="refused", trial=6, text="not ready"),
        Intent(trial=6, isi_ms=1.0, t_s=27.0),
        Intent(trial=7, isi_ms=1.0, t_s=31.0),
    ]
    told = counted(replace(record, history=(*record.history, *after)))
    assert told["shortest time between two stimuli"][0] == "4.00 s; across a resumption not known"
    assert told["refused before delivery"][0] == "1"


@pytest.mark.parametrize(
    ("gap_s", "simulated", "said"),
    [
        (3.0, False, "3.00 s"),
        (60.0, False, "5.00 s"),
        (-600.0, False, "5.00 s; across a resumption not known"),  # the clock was set back
        (3.0, True, "5.00 s; across a resumption not known"),  # whose clock is virtual
    ],
)
def test_the_time_across_a_resumption_is_the_computers(
    record: SessionRecord, gap_s: float, *, simulated: bool, said: str
) -> None:
    history = (*record.history, Event(kind="resume", trial=5), Intent(trial=6, isi_ms=1.0, t_s=0.0))
    onsets = {**record.onsets, 6: Onset(max(0.0, gap_s) + record.onsets[5].onset_s, 0)}
    header = record.header.model_copy(update={"device": replace(record.header.device, simulated=simulated)})
    found = counted(replace(record, header=header, history=history, onsets=onsets))
    assert found["shortest time between two stimuli"][0] == said


def test_what_isiw_excluded_is_not_the_operators(record: SessionRecord) -> None:
    history = (*record.history, Event(kind="exclusion", trial=0, text="far from those asked", finding=Kind.ISIS_FAR))
    why = {number: why for number, _, why in lost_rows(replace(record, history=history))}
    assert why[0] == "excluded by isiw: far from those asked"
    assert why[4] == "excluded by the operator: sneezed"


def test_a_log_without_times_says_so(record: SessionRecord) -> None:
    still = [entry.model_copy(update={"t_s": 0.0}) if isinstance(entry, Intent) else entry for entry in record.history]
    assert counted(replace(record, history=tuple(still)))["shortest time between two stimuli"][0] == "not known"


def test_stimuli_of_unknown_outcome_are_counted_whether_there_is_a_trial_of_them_or_not(record: SessionRecord) -> None:
    unknown = Trial(6, Status.MISTRIAL, 190.0, Kind.OUTCOME_UNKNOWN)
    history = (*record.history, Intent(trial=6, isi_ms=190.0), unknown, Intent(trial=7, isi_ms=10.0))
    said = counted(replace(record, history=history))
    assert said["stimuli delivered"][0] == "8"
    assert said["of them with an unknown outcome"][0] == "2"
    assert said["ISIs commanded"][0] == "10–190 ms"
