from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.log.record import SessionRecord, read_session
from isiw.priors import Difference
from isiw.report.comparison import comparison_page, save_comparison
from isiw.session.loop import Session
from report.sessions import HOSTILE, Page
from scripted import ScriptedDevice, scripted_strategy


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> SessionRecord:
    log = tmp_path_factory.mktemp("compared") / "s.mcap"
    Session(ScriptedDevice(), scripted_strategy(4), log=log, subject=HOSTILE).run()
    return read_session(log)


def difference(record: SessionRecord) -> Difference:
    return Difference(record, record, same_person=True, starts_later=0.97, ends_later=0.6, moved=0.91)


def test_the_page_says_how_probable_a_difference_is_and_has_a_row_a_session(record: SessionRecord) -> None:
    page = Page(comparison_page([record, record], [difference(record)]))
    moved = "the window moved by more than the usual shift from day to day is 91 % (30 % without data)"
    assert f"the probability that {moved}" in page.words
    cells = page.of("td")
    assert [cells.count(cell) for cell in ("34–94 ms", "29–39 ms", "after 150 ms", "0.90")] == [2, 2, 2, 2]
    assert page.of("h3") == [f"1: {HOSTILE},", f"2: {HOSTILE},"]


def test_what_a_log_says_is_text_and_nothing_is_run_or_fetched(record: SessionRecord) -> None:
    whole = comparison_page([record, record], [difference(record)])
    assert "<script" not in whole
    assert "script-src 'none'" in whole
    assert [value for _, name, value in Page(whole).attributes if name in {"src", "href"} and value[:1] != "#"] == []


def test_a_damaged_log_and_one_without_trials_are_told(record: SessionRecord) -> None:
    damaged, empty = replace(record, losses=("Block 3 is lost.",)), replace(record, history=(), delivered=0)
    words = Page(comparison_page([damaged, empty], [])).words
    assert words.index("s.mcap: Block 3 is lost.") < words.index("too little was measured")


def test_sessions_on_different_clocks_are_refused_and_a_page_replaces_nothing(
    record: SessionRecord, tmp_path: Path
) -> None:
    header = record.header.model_copy(update={"space": DesignSpace(0, 200, reference="impact")})
    with pytest.raises(InvalidValueError, match="one event"):
        comparison_page([record, replace(record, header=header)], [])
    save_comparison([record], [], tmp_path / "c.html")
    with pytest.raises(InvalidValueError, match="not overwritten unasked"):
        save_comparison([record], [], tmp_path / "c.html")
