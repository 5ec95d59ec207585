from __future__ import annotations

import pandas as pd
import pytest

from isiw.errors import LogError
from isiw.log.reader import read_session
from isiw.log.schema import SCHEMA_VERSION, Event, Intent
from isiw.log.writer import LogWriter


def test_the_trials_are_a_data_frame(finished_log):
    trials = read_session(finished_log).trials
    assert isinstance(trials, pd.DataFrame)
    assert trials.index.tolist() == list(range(8))
    assert trials.mep_mv.tolist() == pytest.approx([0.01 * k for k in range(8)])


def test_the_sweeps_are_there_by_trial(finished_log):
    record = read_session(finished_log)
    sweep = record.sweep(3)
    assert set(sweep) == {"emg"}
    assert len(sweep["emg"].values) == 50
    assert record.sweep(99) == {}


def test_an_excluded_trial_is_marked_and_not_gone(tmp_path, header, writes):
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        writes(log, range(3))
        log.append(Event(kind="exclusion", trial=1, text="sneezed"))
    record = read_session(tmp_path / "s.mcap")
    assert record.trials.excluded.tolist() == [False, True, False]
    assert [trial.index for trial in record.table.told] == [0, 2]


def test_an_intent_without_a_trial_is_unknown(tmp_path, header, writes):
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        writes(log, range(2))
        log.append(Intent(trial=2, isi_ms=77.0))
    assert [(i.trial, i.isi_ms) for i in read_session(tmp_path / "s.mcap").unknown] == [(2, 77.0)]


def test_before_the_first_trial_there_is_no_decision(tmp_path, header):
    LogWriter.create(tmp_path / "s.mcap", header).close()
    record = read_session(tmp_path / "s.mcap")
    assert record.decision is None
    assert len(record.trials) == 0


def test_a_log_of_a_newer_version_is_refused(tmp_path, header):
    newer = header.model_copy(update={"schema_version": SCHEMA_VERSION + 1})
    LogWriter.create(tmp_path / "s.mcap", newer).close()
    with pytest.raises(LogError, match=r"newer isiw.*Upgrade"):
        read_session(tmp_path / "s.mcap")
