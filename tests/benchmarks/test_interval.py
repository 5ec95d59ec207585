from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from benchmarks.interval import TABLE_62, Measured, figure_66, light_claim, measured, sd, table_62, within

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results" / "interval.json"


def people_of(mean_ms: float, sd_ms: float) -> np.ndarray:
    """Eight people who produce two intervals in turn, and differ a little."""
    differing = (np.arange(8)[:, None] - 3.5) / 1000
    people: np.ndarray = mean_ms * (1 + differing) + sd_ms * (1 + differing) * np.tile([-1.0, 1.0], (8, 10))
    return people


@pytest.fixture
def exact() -> dict[tuple[float, int], np.ndarray]:
    """People who are as the text has them."""
    return {key: people_of(*theirs) for key, theirs in TABLE_62.items()}


def test_a_mean_that_is_many_standard_errors_off_is_not_reproduced_however_near_it_is() -> None:
    near = {key: people_of(*theirs) for key, theirs in TABLE_62.items()} | {(500.0, 3): people_of(510.0, 58.0)}
    verdict = {claim.what[:31]: claim.verdict for claim in table_62(near)}
    assert verdict["Mean of mode 3 at target 500 ms"].startswith("not, because the law is off by")


def test_people_as_in_the_text_reproduce_all_of_table_6_2(exact: dict[tuple[float, int], np.ndarray]) -> None:
    claims = list(table_62(exact))
    assert len(claims) == 16
    assert {claim.verdict for claim in claims} == {"reproduced"}


@pytest.mark.parametrize(("key", "factor"), [((300.0, 2), 1.06), ((500.0, 2), 0.84)])
def test_people_beyond_what_is_allowed_do_not(
    exact: dict[tuple[float, int], np.ndarray], key: tuple[float, int], factor: float
) -> None:
    mean_ms, sd_ms = TABLE_62[key]
    off = [claim for claim in table_62(exact | {key: people_of(mean_ms, sd_ms * factor)}) if "not" in claim.verdict]
    assert [claim.what[:12] for claim in off] == ["SD of mode 2"]


def test_a_law_without_bias_does_not_reproduce_the_means_that_have_one(
    exact: dict[tuple[float, int], np.ndarray],
) -> None:
    unbiased = {key: people_of(key[0], sd_ms) for key, (_, sd_ms) in TABLE_62.items()}
    verdict = {claim.what[:31]: claim.verdict for claim in table_62(exact | unbiased)}
    failed = {what for what, said in verdict.items() if said != "reproduced"}
    at_300, at_500 = ([f"Mean of mode {mode} at target {ms} ms" for mode in (1, 2, 3, 4)] for ms in (300, 500))
    assert failed == {at_300[0], at_300[1], at_300[3], at_500[2], at_500[3]}
    assert verdict[at_500[3]].startswith("not, because the law is off by")


@pytest.mark.parametrize(("share", "good"), [(0.13, True), (0.10, True), (0.06, False), (0.18, False)])
def test_a_light_that_is_on_too_seldom_is_no_reproduction_either(share: float, *, good: bool) -> None:
    assert (light_claim(share).verdict == "reproduced") is good


def test_an_sd_that_exceeds_another_by_half_as_much_as_in_the_text_is_no_reproduction(
    exact: dict[tuple[float, int], np.ndarray],
) -> None:
    claims = figure_66(exact | {(500.0, 1): people_of(499.0, 75.0)})
    assert [claim.what for claim in claims if claim.verdict != "reproduced"] == [
        "The SD of mode 1 exceeds that of mode 4"
    ]


def test_a_statement_of_fig_6_6_that_fails_is_said_to_fail(exact: dict[tuple[float, int], np.ndarray]) -> None:
    assert {claim.verdict for claim in figure_66(exact)} == {"reproduced"}
    steady = exact | {(500.0, 1): people_of(500.0, 10.0)}
    assert [claim.verdict.startswith("not, because") for claim in figure_66(steady)] == [True, True, True, False]


@pytest.mark.parametrize(("theirs", "good"), [(104.0, True), (106.1, False), (93.9, False)])
def test_two_standard_errors_are_the_limit(theirs: float, *, good: bool) -> None:
    claim = within("Table 6.3", "Mean", theirs, Measured(100.0, 3.0), "ms", "of this")
    assert claim.verdict == ("reproduced" if good else "not, because of this")


def test_the_error_is_the_sd_over_groups() -> None:
    times_ms = np.repeat(np.arange(8.0), 2).reshape(8, 2)
    ours = measured(times_ms, lambda times: float(times.mean()))
    assert ours.value == 3.5
    assert ours.error == pytest.approx(np.std([1.5, 5.5], ddof=1))
    assert sd(times_ms) == pytest.approx(np.arange(8).std())


def test_the_results_speak_of_every_table_and_figure_of_the_chapter_that_has_a_result() -> None:
    claims = json.loads(RESULTS.read_text("utf-8"))["claims"]
    said = {claim["where"] for claim in claims}
    tables = {f"Table 6.{number}" for number in (2, 3, 4)}
    figures = {f"Fig. 6.{number}" for number in range(4, 11)}
    assert tables | figures <= said
    chosen = {claim["verdict"] for claim in claims if claim["where"] in {"Fig. 6.9", "Fig. 6.10"}}
    assert chosen == {"under reading range and trials chosen for Table 6.3's SD"}
