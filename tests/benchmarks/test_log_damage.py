from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.log_damage import all_cases, drawn_cases, faults, write_log


@pytest.mark.parametrize(
    "number", [pytest.param(200, marks=pytest.mark.slow), pytest.param(500, marks=pytest.mark.long)]
)
def test_hundreds_of_damaged_logs_hang_raise_invent_and_hide_nothing(tmp_path: Path, number: int) -> None:
    content = write_log(tmp_path / "s.mcap")
    cases = drawn_cases(len(content), number)
    assert len(set(cases)) == number < len(all_cases(len(content)))
    assert list(faults(tmp_path / "s.mcap", content, cases)) == []
