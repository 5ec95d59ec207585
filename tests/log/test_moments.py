"""How long ago something was, whatever the clock was set to."""

from __future__ import annotations

import pytest

from isiw.log.moments import Moment

NOW = Moment(0, "this start", 10.0)


def test_the_time_between_two_moments_of_one_start_is_measured() -> None:
    assert NOW.since_s(Moment(99, "this start", 4.0)) == 6.0


@pytest.mark.parametrize("other", [Moment(0), Moment(0, "another start", 4.0), Moment(0, "this start", None)])
def test_across_starts_or_without_that_clock_it_is_not_known(other: Moment) -> None:
    assert (NOW.since_s(other), other.since_s(NOW)) == (None, None)
