"""The rule by which realised ISIs are in doubt."""

from __future__ import annotations

import pytest

from isiw.design import DesignSpace
from isiw.signals.plausible import doubtful_from, far_ms, is_far


@pytest.mark.parametrize(
    ("space", "expected_ms"),
    [
        (DesignSpace(0, 320, reference="impact"), 20.0),
        (DesignSpace(0, 320, reference="impact", tolerance_ms=1.0), 20.0),
        (DesignSpace(0, 320, reference="impact", tolerance_ms=30.0), 60.0),
        (DesignSpace(0, 30, reference="impact"), 10.0),
        (DesignSpace(1, 10, reference="impact"), 5.0),
    ],
)
def test_far_follows_from_tolerance_and_range(space: DesignSpace, expected_ms: float) -> None:
    assert far_ms(space) == expected_ms


def test_an_isi_that_was_not_measured_is_far_only_beyond_its_uncertainty() -> None:
    space = DesignSpace(0, 320, reference="impact")
    assert is_far(-40.0, space)
    assert not is_far(-40.0, space, isi_sd_ms=10.0)


@pytest.mark.parametrize(
    ("far", "first"),
    [("", None), ("fnfnnf", None), ("ff", None), ("nfff", 1), ("fnfnf", 0), ("fnnnnfnfnfnn", 5), ("nffnf", 1)],
)
def test_three_far_ones_among_five_in_a_row_are_in_doubt_from_the_first(far: str, first: int | None) -> None:
    assert doubtful_from([one == "f" for one in far]) == first
