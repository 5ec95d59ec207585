"""The oracle of both kinds of segment, and the claims of the dissertation beside ours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from benchmarks.inhibition_claims import (
    PRINTED,
    SUB_ISIS_MS,
    SUPRA_ISIS_MS,
    by_chance,
    number_of_values,
    of_two_days,
    royston_p,
)
from benchmarks.opposed_oracle import OpposedOracle
from scipy.stats import shapiro

from isiw.design import DesignSpace
from isiw.metrics import f1
from isiw.subjects.cohorts import cohort
from isiw.subjects.responses import RecruitmentResponse
from known import instance

SPACE = DesignSpace(0, 120, reference="impact")


@pytest.mark.slow
def test_where_there_is_next_to_no_noise_it_reports_the_true_segments() -> None:
    person = cohort("supra-threshold", 1, 5)[0]
    response = instance(RecruitmentResponse, person.response)
    # Far from saturation, so that the enhancement is as clear as the depression.
    clear = replace(response, x50_pct_rmt=125.0, boost_pct_rmt=15.0, sigma_x_pct_rmt=0.5, sigma_y=0.05)
    person = replace(person, response=clear)
    oracle, responder = OpposedOracle(person, SPACE), person.begin(1)
    for isi_ms in SPACE.grid_ms[::3].tolist():
        oracle.tell(isi_ms, responder.respond(isi_ms, "impact").mep_mv)
    assert oracle.ask() in oracle.candidates_ms
    assert f1(oracle.estimate("enhanced"), person.window(SPACE), SPACE) > 0.9
    assert f1(oracle.estimate("depressed"), person.depressed(SPACE), SPACE) > 0.9


def test_it_knows_people_with_both_kinds_of_segment_only() -> None:
    with pytest.raises(TypeError):
        OpposedOracle(cohort("recruitment", 1, 5)[0], SPACE)


def test_the_printed_tests_of_normality_are_of_as_many_values_as_there_are_isis() -> None:
    numbers = {name: number_of_values(w, p) for name, (w, p) in PRINTED.items()}
    assert numbers == {"Subthreshold": [len(SUB_ISIS_MS)], "Suprathreshold": [len(SUPRA_ISIS_MS)]}


@pytest.mark.parametrize("n", [21, 40])
def test_the_p_value_from_w_is_that_of_scipy(n: int) -> None:
    found = shapiro(np.random.default_rng(n).exponential(size=n) ** 0.5)
    assert royston_p(float(found.statistic), n) == pytest.approx(float(found.pvalue), rel=1e-3)


@pytest.mark.parametrize(
    ("same", "verdict"),
    [(0.9, "not, because half of the simulated people keep their window"), (0.5, "under reading: the cohort")],
)
def test_people_who_keep_their_window_do_not_show_another_one_on_another_day(same: float, verdict: str) -> None:
    assert of_two_days([0.3, same, 0.95]).verdict.startswith(verdict)


@pytest.mark.parametrize(
    ("above", "said"),
    [(5, "(10 and 5 of 30 people; chance gives as much)"), (0, "(10 and 0 of 30 people; p = 0.0008)")],
)
def test_a_difference_between_shares_says_whether_chance_gives_as_much(above: int, said: str) -> None:
    assert by_chance(pd.Series({"Subthreshold": 10 / 30, "Suprathreshold": above / 30}), 30) == said
