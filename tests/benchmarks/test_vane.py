"""The comparison with the dissertation, as committed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from benchmarks.vane import filled_bar

from isiw.devices.robot.vane.rotation import Supply

RESULTS = json.loads((Path(__file__).parents[2] / "benchmarks" / "results" / "vane.json").read_text("utf-8"))
FIGURES = {"Table 7.1", *(f"Fig. 7.{number}" for number in (*range(1, 9), "9a", "9b", "10a", "10b", "11a", "11b"))}


def test_every_table_and_figure_of_the_chapter_has_a_claim_with_a_verdict() -> None:
    claims = RESULTS["claims"]
    assert {figure for figure in FIGURES if not any(figure in claim["where"] for claim in claims)} == set()
    for claim in claims:
        assert list(claim) == ["where", "what", "theirs", "ours", "difference", "verdict", "fails_for"]
        assert claim["verdict"].startswith(("under reading ", "not, because "))


@pytest.mark.parametrize(
    ("begins", "places"),
    [
        ("under reading taken over, not a result", {"Fig. 7.6", "Fig. 7.7", "Table 7.1"}),
        ("under reading fitted: ", {"Fig. 7.10a", "Fig. 7.10b", "Fig. 7.11a"}),
    ],
)
def test_what_was_put_in_or_fitted_is_said_to_be(begins: str, places: set[str]) -> None:
    assert {claim["where"] for claim in RESULTS["claims"] if claim["verdict"].startswith(begins)} == places


def test_the_sweep_and_the_solver_are_as_fast_and_exact_as_asked_for() -> None:
    assert RESULTS["facts"]["seconds for 20 x 20"] < 60
    assert np.shape(RESULTS["The plane"]["range_share"]) == (20, 20)
    assert max(RESULTS["Errors of the solver [%]"][0].values()) < 0.5


@pytest.mark.parametrize("critical", [0.2, 0.35])
def test_the_closed_form_obeys_the_flow_that_it_was_derived_from(critical: float) -> None:
    supply, times_ms = Supply(critical_ratio=critical), np.linspace(0, 140, 1401)
    pressure = filled_bar(times_ms, 1e-4, supply)
    ratio = pressure[1:-1] / 4.0
    excess = np.maximum((ratio - critical) / (1 - critical), 0)
    expected = 0.99 * 4.0 * np.sqrt(np.maximum(1 - excess**2, 0)) / 100  # l/s bar by 100 ml [bar/ms]
    assert np.gradient(pressure, times_ms)[1:-1] == pytest.approx(expected, abs=2e-3)
    assert pressure[0] == pytest.approx(1.0)
    assert pressure[-1] == pytest.approx(4.0)
