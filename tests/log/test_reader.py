from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from isiw.devices.limits import Limits
from isiw.errors import LogError
from isiw.log.headers import SCHEMA_VERSION, Header
from isiw.log.record import read_session
from isiw.log.salvage import salvage
from isiw.log.schema import Event, Intent, Waveform
from isiw.log.writer import LogWriter
from isiw.sweeps import Channel
from log.written import write_trials
from logs import damage


def test_the_trials_are_a_data_frame(finished_log: Path) -> None:
    trials = read_session(finished_log).trials
    assert isinstance(trials, pd.DataFrame)
    assert trials.index.tolist() == list(range(8))
    assert trials.mep_mv.tolist() == pytest.approx([0.01 * k for k in range(8)])


def test_the_sweeps_are_there_by_trial(finished_log: Path) -> None:
    record = read_session(finished_log)
    sweep = record.sweep(3)
    assert set(sweep) == {"emg"}
    assert len(sweep["emg"].values) == 50
    assert record.sweep(99) == {}


def test_an_excluded_trial_is_marked_and_not_gone(tmp_path: Path, header: Header) -> None:
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        write_trials(log, range(3))
        log.append(Event(kind="exclusion", trial=1, text="sneezed"))
    record = read_session(tmp_path / "s.mcap")
    assert record.trials.excluded.tolist() == [False, True, False]
    assert [trial.index for trial in record.table.told] == [0, 2]


def test_an_intent_without_a_trial_is_unknown(tmp_path: Path, header: Header) -> None:
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        write_trials(log, range(2))
        log.append(Intent(trial=2, isi_ms=77.0))
    assert [(i.trial, i.isi_ms) for i in read_session(tmp_path / "s.mcap").unknown] == [(2, 77.0)]


def test_a_record_is_printed_with_what_is_unknown_and_what_is_lost(tmp_path: Path, header: Header) -> None:
    with LogWriter.create(tmp_path / "s.mcap", header) as log:
        write_trials(log, range(2))
        log.append(Intent(trial=2, isi_ms=30.0))
    record = read_session(tmp_path / "s.mcap")
    assert "\nTrials: 2 delivered, 2 told, 1 of unknown outcome\n" in str(record)
    assert "\nLost: the end.\nLog: " in str(replace(record, losses=("the end.",)))


def test_before_the_first_trial_there_is_no_decision(tmp_path: Path, header: Header) -> None:
    LogWriter.create(tmp_path / "s.mcap", header).close()
    record = read_session(tmp_path / "s.mcap")
    assert record.decision is None
    assert len(record.trials) == 0


def test_a_log_of_a_newer_version_is_refused(tmp_path: Path, header: Header) -> None:
    newer = header.model_copy(update={"schema_version": SCHEMA_VERSION + 1})
    LogWriter.create(tmp_path / "s.mcap", newer).close()
    with pytest.raises(LogError, match=r"newer isiw.*Upgrade"):
        read_session(tmp_path / "s.mcap")


@pytest.fixture
def resumed_log(finished_log: Path, header: Header) -> tuple[Path, Header]:
    """A log whose second header stands in another block than its first, and that header."""
    with LogWriter.continuing(finished_log, salvage(finished_log), header) as log:
        for trial in range(8, 11):
            noise = np.random.default_rng(trial).standard_normal(20_000)
            log.append(Waveform.of(trial, Channel(noise, 3000.0, "mV")), "emg")
    tightened = header.model_copy(update={"limits": Limits.of_space(header.space, max_pulses=50)})
    LogWriter.continuing(finished_log, salvage(finished_log), header, tightened).close()
    return finished_log, tightened


def test_the_last_header_holds(resumed_log: tuple[Path, Header]) -> None:
    log, tightened = resumed_log
    assert read_session(log).header == tightened


def test_the_last_header_holds_where_its_record_is_lost(resumed_log: tuple[Path, Header]) -> None:
    log, tightened = resumed_log
    damage(log)
    assert [message.topic for message in salvage(log).messages].count("/header") == 1
    record = read_session(log)
    assert record.losses
    assert record.header == tightened


def test_a_damaged_configuration_is_said_and_not_believed(broken_log: Path, header: Header) -> None:
    whole = broken_log.read_bytes()
    broken_log.write_bytes(whole.replace(b"max_pulses = 200", b"max_pulses = 900"))
    record = read_session(broken_log)
    assert record.header == header
    assert record.losses == ("The attachment configuration.toml fails its checksum and is lost.",)


@pytest.mark.parametrize("path", [None, 5, b"s.mcap", ["s.mcap"]])
def test_what_is_no_path_is_an_error_of_its_own(path: Path) -> None:
    with pytest.raises(LogError, match=r"named by its path"):
        read_session(path)
