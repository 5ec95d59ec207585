from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from isiw.log.reader import SessionRecord, read_session
from isiw.log.schema import Estimate
from isiw.report.words import (
    PROGRESS_HEADINGS,
    TRIAL_HEADINGS,
    final_statement,
    progress_row,
    trial_rows,
    truth_sentence,
)
from isiw.session.loop import Session, SessionUpdate
from isiw.session.resume import exclude
from isiw.strategy.stopping import StopDecision
from isiw.trials import Measurement, MistrialReason, Status, Trial
from isiw.window import Window, WindowEstimate
from known import instance
from scripted import ScriptedDevice, scripted_strategy


@pytest.fixture
def record(tmp_path: Path) -> SessionRecord:
    device = ScriptedDevice(lambda s: Measurement(0.0512, s.isi_ms, background_rms_uv=50.0 if s.trial == 1 else 2.0))
    Session(device, scripted_strategy(4), log=tmp_path / "s.mcap").run()
    return read_session(tmp_path / "s.mcap")


def with_estimate(record: SessionRecord, **changes: Any) -> SessionRecord:
    entries = list(record.history)
    entries[-1] = instance(Estimate, entries[-1]).model_copy(update=changes)
    return type(record)(record.path, record.header, tuple(entries), {}, (), True)


def test_the_statement_has_window_intervals_counts_and_reason(record: SessionRecord) -> None:
    assert final_statement(record) == (
        "The tap enhances the MEP at ISIs of 33–93 ms after the valve command (probability of a window: 0.90). "
        "With 90 % probability each, it starts between 28 and 38 ms and ends after 150 ms. "
        "Given a window, it ends beyond the range with probability 0.67. "
        "4 pairs of stimuli were delivered; 3 count; mistrials: 1 background activity. "
        "The budget of 4 stimuli is used up."
    )


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (-math.inf, -math.inf, "starts before 0 ms"),
        (-math.inf, 12.0, "starts before 12 ms"),
        (12.0, math.inf, "starts after 12 ms"),
        (math.inf, math.inf, "starts after 200 ms"),
    ],
)
def test_an_edge_beyond_the_range_is_said_in_words(record: SessionRecord, low: float, high: float, words: str) -> None:
    assert words in final_statement(with_estimate(record, start_low_ms=low, start_high_ms=high))


def test_an_unusual_window_is_said_with_its_probability_once_it_is_worth_saying(record: SessionRecord) -> None:
    statement = final_statement(with_estimate(record, start_beyond=0.25, end_beyond=0.0, split=0.6))
    assert (
        "Given a window, it starts before the range with probability 0.25, "
        "it has more than one segment with probability 0.60." in statement
    )


def test_no_window_is_an_answer(record: SessionRecord) -> None:
    statement = final_statement(with_estimate(record, segments_ms=(), probability=0.07))
    assert statement.startswith("No window was found (probability of a window: 0.07). 4 pairs")


def test_a_window_of_two_segments_is_named_so(record: SessionRecord) -> None:
    statement = final_statement(with_estimate(record, segments_ms=(10.0, 30.0, 60.0, 80.0)))
    assert "10–30 ms and 60–80 ms" in statement


def test_a_session_that_is_not_over_says_how_to_go_on(record: SessionRecord) -> None:
    assert "isiw resume" in final_statement(with_estimate(record, stop=False, reason="5 stimuli are left."))


def test_an_exclusion_after_the_estimate_is_said(record: SessionRecord) -> None:
    exclude(record.path, 0, "sneezed")
    statement = final_statement(read_session(record.path))
    assert "1 excluded" in statement
    assert "excluded after this estimate" in statement


def test_without_a_trial_there_is_nothing_to_say(record: SessionRecord) -> None:
    empty = type(record)(record.path, record.header, (), {}, (), False)
    assert final_statement(empty) == "No trial has been completed."


def test_the_truth_is_compared_by_f1(record: SessionRecord) -> None:
    assert truth_sentence(record, Window(33, 93)).endswith("has the window 33–93 ms; the result has an F1 of 1.00.")
    assert truth_sentence(record, None).endswith("has no window; the result has an F1 of 0.00.")


def test_every_trial_has_a_row(record: SessionRecord) -> None:
    rows = trial_rows(record)
    assert len(rows) == 4
    assert all(len(row) == len(TRIAL_HEADINGS) for row in rows)
    assert rows[0][2] == "51 µV"
    assert rows[1][2] == "mistrial: background activity"


def update_with(estimate: WindowEstimate, trial: Trial) -> SessionUpdate:
    return SessionUpdate(trial, estimate, StopDecision(stop=False, reason=""), 3.0, 17)


def test_progress_tells_trial_isi_mep_window_intervals_and_what_is_left() -> None:
    samples = np.array([[-math.inf, 90.0], [10.0, 95.0], [12.0, math.inf]])
    estimate = WindowEstimate(0.876, Window(10, 95), 10.0, 95.0, edge_samples_ms=samples)
    row = progress_row(update_with(estimate, Trial(3, Status.ACCEPTED, 40.0, isi_ms=41.0, mep_mv=0.0312)))
    assert row == ("3", "40 ms", "31 µV", "0.88", "10–95 ms", "<–12", "90–>", "17")
    assert len(row) == len(PROGRESS_HEADINGS)


def test_progress_of_a_method_without_posterior_has_gaps() -> None:
    trial = Trial(3, Status.MISTRIAL, None, MistrialReason.NO_IMPACT)
    assert progress_row(update_with(WindowEstimate(None, None), trial)) == (
        "3", "–", "mistrial: no impact", "", "none", "", "", "17"
    )  # fmt: skip
