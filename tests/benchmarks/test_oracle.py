"""The benchmarks' oracle knows the cohort's windows, and the rule."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.oracle import SPANS, Oracle, Spans, outcome_table, spans_of

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.metrics import f1
from isiw.subjects.cohorts import cohort
from isiw.subjects.measured import LABS
from isiw.subjects.responses import PeakProfile
from isiw.subjects.subject import SimulatedSubject


def told_everything(person: SimulatedSubject, space: DesignSpace) -> Oracle:
    assert isinstance(person.profile, PeakProfile)
    span = Spans(np.array([person.profile.start_ms]), np.array([person.profile.width_ms]), np.ones(1))
    return Oracle(person, space, span)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gaussian", "recruitment"])
@pytest.mark.parametrize("high_ms", [500, 300])
def test_told_start_and_width_it_reports_the_true_window_wherever_the_range_ends(name: str, high_ms: int) -> None:
    space = DesignSpace(0, high_ms, reference="valve")
    people = cohort(name, 3, seed=1)[1:]  # of one of them a range of 300 ms holds no peak
    scores = [f1(told_everything(person, space).estimate(), person.window(space), space) for person in people]
    assert min(scores) > 0.97


@pytest.mark.slow
def test_without_a_window_it_says_so() -> None:
    nonresponder = cohort("nonresponder", 2, seed=1)[1]  # of recruitment noise
    assert nonresponder.window(VALVE_SPACE) is None
    assert Oracle(nonresponder, VALVE_SPACE, spans_of("recruitment", 1)).estimate() is None


@pytest.mark.slow
def test_the_second_oracle_says_no_window_only_where_that_is_likelier_than_any_is_good() -> None:
    person = cohort("recruitment", 1, seed=1)[0]
    assert isinstance(person.profile, PeakProfile)
    spans = spans_of("recruitment", 1)
    sure, unsure = Oracle(person, VALVE_SPACE, spans), Oracle(person, VALVE_SPACE, spans, p_window=0.3)
    middle_ms = person.hit_delay_ms + person.profile.start_ms + 0.5 * person.profile.width_ms
    assert sure.estimate() is not None
    assert unsure.estimate() is None
    for _ in range(8):  # an MEP far above the floor at the peak: there is a window
        unsure.tell(middle_ms, 0.4)
    assert unsure.estimate() is not None


@pytest.mark.slow
@pytest.mark.parametrize("name", [*SPANS, *LABS])
def test_its_spans_are_those_of_the_cohort(name: str) -> None:
    # Shares of 1,000 people have standard errors below .016; what is left is the distance of the values.
    people = cohort(name, 1000, seed=1)
    spans = spans_of(name, seed=1)
    assert spans.shares.sum() == pytest.approx(1.0)
    known = {"width_ms": spans.widths_ms, "start_ms": spans.starts_ms}
    if name in {"kim11", "kim11-measured"}:  # eleven people have eleven starts
        del known["start_ms"]
    for latent, known_ms in known.items():
        drawn_ms = np.array([getattr(person.profile, latent) for person in people])
        for at_ms in np.quantile(drawn_ms, [0.1, 0.3, 0.5, 0.7, 0.9]):
            assert spans.shares[known_ms <= at_ms].sum() == pytest.approx((drawn_ms <= at_ms).mean(), abs=0.06)
        if name in LABS or (name, latent) == ("another-day", "start_ms"):  # laws without ends
            continue
        assert (known_ms.min(), known_ms.max()) == pytest.approx((drawn_ms.min(), drawn_ms.max()), abs=3.0)


def test_a_cohort_whose_windows_it_does_not_know_is_refused() -> None:
    with pytest.raises(ValueError, match="two-peak"):
        spans_of("two-peak", 1)


@pytest.mark.slow
def test_its_law_of_the_mep_is_the_simulators_artefacts_included() -> None:
    subject = replace(cohort("outliers", 1, 3)[0], outlier_probability=0.3, jitter_reported=True)
    edges_mv, mass = outcome_table(subject)
    responder = subject.begin(5)
    answers_mv = np.array([responder.respond(None, "valve").mep_mv for _ in range(20_000)])
    below = (answers_mv[:, None] < edges_mv).mean(0)
    assert np.abs(below - mass[0].cumsum()[:-1]).max() < 0.03  # floors on 24 nodes
