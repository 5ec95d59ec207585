"""The table of trials: when each was, and what was believed after it."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd
import pytest

from isiw.log.frames import TRIAL_COLUMNS
from isiw.log.headers import Header
from isiw.log.record import read_session
from isiw.log.records import Onsets
from isiw.log.schema import Event, Intent
from isiw.log.writer import LogWriter
from isiw.session.loop import Session
from isiw.session.resuming import resume
from log.written import write_trials
from scripted import ScriptedDevice, scripted_strategy


def onsets_s(*intents: tuple[float, float] | None) -> list[float]:
    """Onsets of intents (by the session's clock, by the log) [s]; None is a resumption."""
    onsets = Onsets()
    for trial, intent in enumerate(intents):
        if intent is None:
            onsets.take(Event(kind="resume"), 0)
        else:
            onsets.take(Intent(trial=trial, isi_ms=5.0, t_s=intent[0]), int(1e9 * intent[1]))
    return [onset.onset_s for onset in onsets.by_trial.values()]


def test_onsets_are_those_of_the_sessions_clock() -> None:
    assert onsets_s((100.0, 7.0), (105.0, 7.1), (111.5, 7.2)) == [0.0, 5.0, 11.5]


def test_across_a_resumption_the_log_says_how_long_it_was() -> None:
    found = onsets_s((100.0, 7.0), (105.0, 7.1), None, (300.0, 67.1), (306.0, 67.2))
    assert found == pytest.approx([0.0, 5.0, 65.0, 71.0])


def test_where_the_clock_stood_still_or_ran_backwards_the_log_says_how_long_it_was() -> None:
    assert onsets_s((0.0, 7.0), (0.0, 12.0)) == [0.0, 5.0]
    assert onsets_s((90.0, 7.0), (3.0, 12.0), (9.0, 12.5)) == [0.0, 5.0, 11.0]


def test_a_computer_that_slept_has_gone_on_as_its_own_clock_says() -> None:
    onsets = Onsets()
    for trial, (t_s, boot_s) in enumerate([(0.0, 50.0), (10.0, 60.0), (11.0, 660.0), (11.0, 660.5), (3.0, 661.0)]):
        onsets.take(Intent(trial=trial, isi_ms=5.0, t_s=t_s, boot_id="this start", boot_s=boot_s), 0)
    assert [onset.onset_s for onset in onsets.by_trial.values()] == [0.0, 10.0, 610.0, 610.5, 611.0]


def test_a_stimulus_that_was_refused_is_not_the_first() -> None:
    onsets = Onsets()
    for t_s in (100.0, 101.0):
        onsets.take(Intent(trial=0, isi_ms=5.0, t_s=t_s), int(1e9 * t_s))
        onsets.take(Event(kind="refused"), 0)
    for trial, t_s in enumerate((102.0, 107.0)):
        onsets.take(Intent(trial=trial, isi_ms=5.0, t_s=t_s), int(1e9 * t_s))
    assert [onset.onset_s for onset in onsets.by_trial.values()] == [0.0, 5.0]


def test_a_computers_clock_that_was_set_back_makes_no_onset_smaller() -> None:
    assert onsets_s((0.0, 12.0), (0.0, 7.0)) == [0.0, 0.0]


def test_every_column_is_described_and_there(tmp_path: Path) -> None:
    Session(ScriptedDevice(), scripted_strategy(3), log=tmp_path / "s.mcap").run()
    record = read_session(tmp_path / "s.mcap")
    trials = record.trials
    assert list(trials.columns) == list(TRIAL_COLUMNS)
    assert trials.onset_s.tolist() == [0.0, 5.0, 10.0]
    assert trials.p_window.tolist() == [estimate.probability for estimate in record.estimates]
    assert trials.window_start_ms.tolist() == [31.0, 32.0, 33.0]
    assert math.isinf(trials.end_ms[0])
    assert trials.next_isi_ms.iloc[:2].tolist() == trials.commanded_isi_ms.iloc[1:].tolist()
    assert str(trials.intent_utc.dtype).endswith("UTC]")
    assert pd.Timestamp(record.header.created) <= trials.intent_utc[0]


def test_a_resumed_session_has_ascending_onsets(tmp_path: Path) -> None:
    Session(ScriptedDevice(), scripted_strategy(2), log=tmp_path / "s.mcap").run()
    resume(tmp_path / "s.mcap", ScriptedDevice(), scripted_strategy(4)).run()
    assert read_session(tmp_path / "s.mcap").trials.onset_s.is_monotonic_increasing


@pytest.mark.parametrize("trials", [0, 2])
def test_columns_have_the_same_kind_with_and_without_trials(tmp_path: Path, header: Header, trials: int) -> None:
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        write_trials(log, range(trials))
    kinds = read_session(tmp_path / "s.mcap").trials.dtypes
    assert {str(kinds[name]) for name in ("onset_s", "t_tms_ms", "p_window", "isi_ms")} == {"float64"}
    assert {str(kinds[name]) for name in ("excluded", "tap_alone")} == {"bool"}
