import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import isiw
from isiw.errors import InvalidValueError
from isiw.log.record import SessionRecord
from isiw.models.particles.supra.prior import SupraPrior
from isiw.priors.above_threshold import SAME_VISIT, above
from isiw.visit import Visit
from priors.logged import gaussian_person, write_log

IMPACT = isiw.DesignSpace(0, 300, reference="impact")


def below(path: Path, **more: object) -> SessionRecord:
    """A session below the threshold."""
    return isiw.read_session(write_log(path, space=IMPACT, visit=Visit(intensity_pct_rmt=90.0), **more))  # type: ignore[arg-type]


def density_at(prior: SupraPrior, low_ms: float, high_ms: float) -> float:
    """The probability of a start between two ISIs."""
    knots = prior.start.knots(IMPACT)
    below = np.interp([low_ms, high_ms], knots.start_ms, knots.below)
    return float(below[1] - below[0])


def test_starts_above_the_threshold_are_expected_where_the_window_below_it_started(tmp_path: Path) -> None:
    prior = above(below(tmp_path / "sub.mcap"))
    true = gaussian_person().window(IMPACT)
    assert true is not None
    around = true.start_ms - 15.0, true.start_ms + 15.0
    assert density_at(prior, *around) > 1.3 * density_at(SupraPrior(), *around)
    assert math.isclose(sum(span.share for span in prior.start.spans), 1.0)


def test_starts_from_the_valve_need_the_hit_delay(tmp_path: Path) -> None:
    known = isiw.read_session(write_log(tmp_path / "known.mcap", hit_delay_ms=(180.0, 2.0)))
    assert len(above(known).start.spans) > len(SupraPrior().start.spans)
    unknown = isiw.read_session(write_log(tmp_path / "unknown.mcap"))
    with pytest.raises(InvalidValueError, match="where the window lies after the impact is not known"):
        above(unknown)


def test_a_session_at_or_above_the_threshold_is_no_first_step(tmp_path: Path) -> None:
    loud = isiw.read_session(write_log(tmp_path / "loud.mcap", space=IMPACT, visit=Visit(intensity_pct_rmt=110.0)))
    with pytest.raises(InvalidValueError, match="is a session below the motor threshold"):
        above(loud)


@pytest.mark.slow
def test_a_window_of_another_day_is_less_certain_than_of_the_same_visit(tmp_path: Path) -> None:
    record, other_day = below(tmp_path / "sub.mcap"), isiw.priors.DayToDay()
    true = gaussian_person().window(IMPACT)
    assert true is not None
    around = true.start_ms - 10.0, true.start_ms + 10.0
    assert density_at(above(record, law=SAME_VISIT), *around) > density_at(above(record, law=other_day), *around)


def test_no_window_below_the_threshold_leaves_the_search_above_it_nearly_as_it_is(tmp_path: Path) -> None:
    person = gaussian_person()
    nobody = replace(person, profile=replace(person.profile, start_ms=5000.0))  # type: ignore[type-var]
    record = below(tmp_path / "none.mcap", person=nobody)
    usual, prior = SupraPrior(), above(record)
    assert density_at(prior, 0.0, 95.0) == pytest.approx(density_at(usual, 0.0, 95.0), abs=0.25)
