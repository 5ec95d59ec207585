"""What would lead the engine beyond its arrays is refused before it reads them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from isiw.models.particles import jumps
from isiw.models.particles.compiled import Law, Tables
from isiw.models.windows import CUTS
from isiw.native.engine import best_window
from native.drawn import CASES


@pytest.fixture
def tables(monkeypatch: pytest.MonkeyPatch) -> Tables:
    """Those of the default's prior."""
    monkeypatch.setattr(jumps, "Law", lambda tables: tables)
    made = jumps.law_of.__wrapped__(CASES["default"].prior, CASES["default"].space)
    assert isinstance(made, Tables)
    return made


def _blocks(tables: Tables, first: list[int], size: list[int]) -> Tables:
    """The same with other blocks, each of one component."""
    shares = np.zeros((len(first), tables.log_shares.shape[1]), dtype=np.float32)
    tables = tables._replace(first=np.array(first), size=np.array(size), components=np.ones(len(first), int))
    return tables._replace(log_shares=shares, below=shares)


def test_tables_of_a_prior_are_taken(tables: Tables) -> None:
    assert Law(tables).latents == len(tables.spreads)


def test_blocks_that_the_engine_has_no_room_for_are_refused(tables: Tables) -> None:
    latents = len(tables.spreads)
    one = tables._replace(renewed=np.zeros_like(tables.renewed), changed=0)
    assert Law(_blocks(one, [0] * 64, [1] * 64)).blocks == 64
    for first, size in (([0] * 65, [1] * 65), ([0], [latents + 1]), ([latents], [1])):
        with pytest.raises(ValueError, match="beyond themselves"):
            Law(_blocks(one, first, size))


def test_a_law_of_starts_has_two_knots_at_least(tables: Tables) -> None:
    two, one = (
        tables._replace(**{name: getattr(tables, name)[:knots] for name in ("start_ms", "density", "quantiles")})
        for knots in (2, 1)
    )
    assert Law(two)
    with pytest.raises(ValueError, match="beyond themselves"):
        Law(one)


@pytest.mark.parametrize(("meaning", "changed"), [(27, {}), (28, {}), (29, {"apart": True}), (30, {"apart": True})])
def test_latents_that_moves_write_or_compare_are_there(tables: Tables, meaning: int, changed: dict[str, Any]) -> None:
    at = tables.at.copy()
    at[29:31] = 0  # as if the prior had a depression
    assert Law(tables._replace(at=at, **changed))
    at[meaning] = len(tables.spreads)
    with pytest.raises(ValueError, match="beyond themselves"):
        Law(tables._replace(at=at, **changed))


@pytest.mark.parametrize("pairs", [[[-1, 2]], [[2, 1]], [[0, 4]], []])
def test_windows_beyond_the_isis_are_refused(pairs: list[list[int]]) -> None:
    with pytest.raises(ValueError, match="runs of the ISIs"):
        best_window(np.array(pairs, dtype=np.int32).reshape(1, -1, 2), 3, CUTS)


@pytest.mark.parametrize("missing", [{"rows": 1}, {"cells": np.zeros(1)}, {"grid_ms": np.zeros(0)}])
def test_tables_of_predictions_have_rows_outcomes_and_isis(tables: Tables, missing: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="beyond themselves"):
        Law(tables._replace(**missing))
