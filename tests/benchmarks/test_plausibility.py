from __future__ import annotations

import pytest
from benchmarks.plausibility import SLIPS, report, right, slips


def test_every_slip_is_refused_or_flagged_within_four_trials() -> None:
    sessions = slips(5, particles=100)
    assert set(sessions) == set(SLIPS)
    assert all(told.trials is not None for of_a_slip in sessions.values() for told in of_a_slip)


@pytest.mark.slow
def test_right_data_are_told_as_they_are() -> None:
    sessions = right(1, 12, particles=100)
    assert [kind for kind, told in sessions.items() if told[0].trials is not None] == []
    assert len(sessions) == 9
    assert "| all | 0 of 9 |" in report({}, sessions, 12, "command")
