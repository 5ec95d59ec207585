"""Minutes on the table: the dissertation's own sums."""

from __future__ import annotations

import pytest
from benchmarks.reduction.conventional import trials_inside
from benchmarks.reduction.dissertation import WIDTHS_MS
from benchmarks.reduction.timing import BREAKS_OF_A_FULL_SWEEP, minutes


def test_a_full_sweep_of_600_trials_takes_the_130_minutes_of_the_text() -> None:
    assert minutes(600, BREAKS_OF_A_FULL_SWEEP) == pytest.approx(130.0)


def test_a_session_shorter_than_a_block_has_no_rest() -> None:
    assert minutes(11) == pytest.approx(11 / 60)
    assert minutes(12) == pytest.approx(2.2)


def test_the_texts_271_trials_with_an_sd_of_108_are_those_inside_the_windows_of_its_table() -> None:
    mean, sd = trials_inside(WIDTHS_MS)
    assert mean == pytest.approx(271.6, abs=0.1)
    assert sd == pytest.approx(108, abs=0.5)
