from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from isiw.log.record import SessionRecord, read_session
from isiw.log.schema import EstimateRecord
from isiw.plots.comparison import comparison_figure
from isiw.plots.session import session_figure
from isiw.priors import Difference
from isiw.report.comparison import comparison_page, comparison_sentence, comparison_table
from isiw.sentences import later, moved
from isiw.session.afterwards import exclude
from isiw.session.loop import Session
from isiw.summary import JUDGED_SINCE
from scripted import ScriptedDevice, scripted_strategy


@pytest.fixture
def record(tmp_path: Path) -> SessionRecord:
    Session(ScriptedDevice(), scripted_strategy(4), log=tmp_path / "s.mcap", subject="P07").run()
    return read_session(tmp_path / "s.mcap")


def test_the_table_has_a_line_a_session_with_its_window_and_intervals(record: SessionRecord) -> None:
    headings, first, second = comparison_table([record, record]).splitlines()
    assert headings.split() == [
        "session", "subject", "begun", "(UTC)", "trials", "P(window)", "window", "start", "end"
    ]  # fmt: skip
    assert "P07" in first
    assert first.endswith("4       0.90       34–94 ms  29–39 ms  after 150 ms")
    assert second.startswith("2 ")


def test_an_edge_that_lies_before_the_range_for_certain_is_said_to_do_so(record: SessionRecord) -> None:
    update = {"start_low_ms": -math.inf, "start_high_ms": -math.inf}
    entries = tuple(e.model_copy(update=update) if isinstance(e, EstimateRecord) else e for e in record.history)
    early = type(record)(record.path, record.header, entries, (), True)
    assert "before the range  after 150 ms" in comparison_table([early])


@pytest.mark.parametrize(("probability", "said"), [(0.03, "no window"), (0.25, "undecided"), (None, "no window")])
def test_where_no_window_is_reported_it_may_still_be_undecided(
    record: SessionRecord, probability: float | None, said: str
) -> None:
    update = {"segments_ms": (), "probability": probability}
    entries = tuple(e.model_copy(update=update) if isinstance(e, EstimateRecord) else e for e in record.history)
    open_still = type(record)(record.path, record.header, entries, (), True)
    chance, column = (f" (P(window) = {probability})", probability) if probability else ("", "–   ")
    assert comparison_table([open_still]).splitlines()[1].endswith(f"{column}       {said}")
    words = [text.get_text() for text in comparison_figure([open_still]).axes[0].texts]
    assert words == [f"{said}{chance}"]


def test_a_session_in_which_too_little_was_measured_says_so(record: SessionRecord) -> None:
    empty = type(record)(record.path, record.header, (), (), False)
    assert comparison_table([empty]).splitlines()[1].endswith("–          too little was measured")


def test_of_the_same_person_it_is_said_whether_the_window_moved(record: SessionRecord) -> None:
    difference = Difference(record, record, same_person=True, starts_later=0.97, ends_later=0.6, moved=0.91)
    who = "P07 (s.mcap) against P07 (s.mcap), the same person:"
    assert comparison_sentence(difference) == f"{who} {moved(0.91, 0.3)} {later(0.97, 0.6)}"


def test_where_nothing_can_be_said_it_is_said_why(record: SessionRecord) -> None:
    difference = Difference(record, record, same_person=False, obstacle="There is probably no window: s.mcap")
    assert comparison_sentence(difference) == (
        "P07 (s.mcap) against P07 (s.mcap), different subject codes: There is probably no window: s.mcap."
    )


def test_without_a_subject_code_it_is_not_said_that_the_codes_differ(record: SessionRecord) -> None:
    unnamed = replace(record, header=record.header.model_copy(update={"subject": ""}))
    said = comparison_sentence(Difference(unnamed, record, same_person=False, starts_later=0.9, ends_later=0.9))
    assert "perhaps the same person, as not both have a subject code:" in said


def test_a_session_whose_trials_were_judged_anew_says_so(record: SessionRecord) -> None:
    exclude(record.path, 1, "cough")
    judged = read_session(record.path)
    *lines, said = comparison_table([judged]).splitlines()
    assert len(lines) == 2
    assert said == f"P07 (s.mcap): {JUDGED_SINCE}"
    assert JUDGED_SINCE in comparison_page([judged], [])
    assert "trials; outdated: trials were judged since)" in session_figure(judged).axes[0].get_title(loc="left")
