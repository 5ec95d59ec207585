"""The report's claims as a whole: on made-up sessions, each has one of four verdicts, and the opening counts them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from benchmarks.dissertation.claims import KINDS, Claim, kind_of
from benchmarks.reduction.parallel import frame
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.size import FEW

from benchmarks.reduction import (
    comparison,
    gaussians,
    initial,
    online,
    particles,
    pf_readings,
    reading_table,
    verdicts,
    wrong,
)

pytestmark = pytest.mark.slow  # forty comparisons are summed up: seconds

SIZE = replace(FEW, readings=1, sweep=3)
PARTS = (comparison, reading_table, pf_readings, initial, particles, gaussians, wrong)
SCORES = (
    *("f1, true", "f1, measured", "f1, measured, .135", "f1, measured, 100 % RMT", "f1, measured, 90 % RMT"),
    *("correlation, measured", "correlation, true", "f1, of .135"),
)
COUNTS = ("trials", "whole", "near", "inside measured", "inside measured, 90 %", "inside measured, .135", "inside true")
FLAGS = ("converged", "shows a window", "shows a window, 90 %", "normal", "normal throughout")


def made_up(_session: Session, rng: np.random.Generator) -> dict[str, Any]:
    """What a session might have come to."""
    scores = dict(zip(SCORES, rng.uniform(0.2, 0.9, len(SCORES)).tolist(), strict=True))
    counts = dict(zip(COUNTS, rng.integers(10, 500, len(COUNTS)).tolist(), strict=True))
    spread = {"spread_ms": rng.uniform(10, 140, 10).tolist(), "amplitudes_mv": (0.05, 0.01)}
    return scores | counts | dict.fromkeys(FLAGS, True) | spread


def on_waveforms(rng: np.random.Generator) -> list[dict[str, Any]]:
    grid_ms = np.arange(321.0)
    usual = {"mistrials": 0, "f1": 0.5, "told": [(1.0, 0.1)], "grid_ms": grid_ms}
    return [
        {"person": one.person, "session": 0, "method": one.method, "trials": 300 if one.method == "incremental" else 20}
        | usual
        | {"profile_mv": rng.random(321), "true_mv": rng.random(321)}
        for one in online.plan(1, 3)
    ]


@pytest.fixture(scope="module")
def rows() -> dict[Any, pd.DataFrame]:
    rng = np.random.default_rng(1)
    plans = {part: part.sessions(SIZE, 3) for part in PARTS}
    return {part: frame(plan, {session: made_up(session, rng) for session in plan}) for part, plan in plans.items()}


@pytest.fixture(scope="module")
def claims(rows: dict[Any, pd.DataFrame]) -> list[Claim]:
    return verdicts.all_claims(rows, on_waveforms(np.random.default_rng(2)))


def test_no_claim_is_without_a_verdict(claims: list[Claim]) -> None:
    assert all((claim.fails_for == "–") == (claim.verdict != "reproduced") for claim in claims)
    assert {kind_of(claim) for claim in claims} <= set(KINDS)
    assert len({(claim.where, claim.what) for claim in claims}) == len(claims)


def test_every_figure_and_table_of_the_methods_is_judged(claims: list[Claim]) -> None:
    figures = {f"Fig. 4.{n}" for n in (15, 16, 17, 23, 24, 25, 26, 28, 30, 31, 32, 33, 34)}
    online = {f"Table 5.3{figure}" for figure in ("", ", Fig. 5.12", ", Fig. 5.13")}
    sections = {"Table 4.1", "4.2.1", "4.4.2", "4.4.8", "Fig. 4.24, 4.18", "Fig. 4.24, Fig. 4.14"}
    assert figures | online | sections == {claim.where for claim in claims}


def test_the_opening_says_what_comes_out_and_what_not(rows: dict[Any, pd.DataFrame], claims: list[Claim]) -> None:
    said = verdicts.opening(claims, rows[comparison])
    reproduced = sum(claim.verdict == "reproduced" for claim in claims)
    assert f"{reproduced} of the text's {len(claims)} claims come out as printed" in said
    assert "hold but could not fail" in said
    assert "shows a window in 100 % of `kim11-measured`" in said
    assert "the text has PF last, and here it is" in said
    assert "Which method a bar of Fig. 4.24 (trials) and 4.25 (F1) belongs to was inferred" in said
