from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.log_damage import all_cases, drawn_cases, faults, write_log


@pytest.mark.slow
def test_five_hundred_damaged_logs_hang_raise_invent_and_hide_nothing(tmp_path: Path) -> None:
    content = write_log(tmp_path / "s.mcap")
    cases = drawn_cases(len(content), 500)
    assert len(set(cases)) == 500 < len(all_cases(len(content)))
    assert list(faults(tmp_path / "s.mcap", content, cases)) == []
