from __future__ import annotations

from collections.abc import Sequence

import pytest

from isiw.report.evidence import contradiction, no_comparison
from isiw.trials import Status, Trial
from isiw.window import Window


def trials(inside_mv: Sequence[float], outside_mv: Sequence[float]) -> list[Trial]:
    meps_mv = [(100.0 + k, mep_mv) for k, mep_mv in enumerate(inside_mv)]
    meps_mv += [(200.0 + k, mep_mv) for k, mep_mv in enumerate(outside_mv)]
    return [Trial(k, Status.ACCEPTED, isi, isi_ms=isi, mep_mv=mep) for k, (isi, mep) in enumerate(meps_mv)]


WINDOW = Window(90, 150)


def test_a_window_whose_meps_are_no_larger_is_not_borne_out() -> None:
    said = contradiction(WINDOW, trials([0.02, 0.021, 0.019, 0.02], [0.02, 0.022, 0.021, 0.02]))
    assert said == (
        "The data do not bear this out: the MEPs inside are no larger than those outside (medians 20 and 20 µV)."
    )


@pytest.mark.parametrize(
    ("window", "inside_mv", "outside_mv"),
    [
        (WINDOW, [0.08, 0.05, 0.02, 0.06], [0.02, 0.022, 0.021, 0.02]),
        (WINDOW, [0.01, 0.01, 0.01], [0.02, 0.022, 0.021, 0.02]),
        (None, [0.02, 0.021, 0.019, 0.02], [0.02, 0.022, 0.021, 0.02]),
    ],
)
def test_larger_meps_too_few_of_them_and_no_window_contradict_nothing(
    window: Window | None, inside_mv: list[float], outside_mv: list[float]
) -> None:
    assert contradiction(window, trials(inside_mv, outside_mv)) is None


def test_a_window_with_hardly_a_trial_outside_has_nothing_to_be_compared_with() -> None:
    told = trials([1.0, 1.1, 0.9, 1.0, 1.0], [1.0])
    assert "1 of 6 pairs are outside, and 0 pulses were TMS alone" in str(no_comparison(WINDOW, told))
    alone = [Trial(6 + k, Status.ACCEPTED, None, mep_mv=0.02) for k in range(3)]
    assert no_comparison(WINDOW, [*told, *alone]) is None
    assert no_comparison(None, told) is None
