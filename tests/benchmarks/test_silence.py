from __future__ import annotations

import math

from benchmarks.silence import FIRED, TRIALS, Kind, noticed_at

import isiw


def test_a_stop_is_noticed_where_pulses_had_been_answered_and_not_before() -> None:
    kind, person = Kind("gaussian", "near the edges", limit_mv=0.001), isiw.subjects.cohort("gaussian", 1, 1)[0]
    assert FIRED + 10 <= noticed_at(person, 0, kind, FIRED) < TRIALS
    assert math.isnan(noticed_at(person, 0, kind, TRIALS))
