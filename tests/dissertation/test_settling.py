"""The dissertation's stopping rules: edges, particles and sweeps that have settled."""

from __future__ import annotations

import math

import numpy as np
import pytest

from isiw.dissertation.strategies import Converging, Passing, Settling
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.strategy.decisions import Progress, looks_back
from isiw.strategy.stopping import AnyOf, Budget
from isiw.window import Window


def after_windows(*edges_ms: tuple[float, float] | None) -> Progress:
    """After trials with these windows, the last of them the present one."""
    windows = [None if edges is None else Window(*edges) for edges in edges_ms]
    past = tuple(WindowEstimate(None, window) for window in windows)
    return Progress(40, 40, past[-1], past)


STEADY = [(100.0, 200.0)] * 5
START_MOVES = [(100.0 + 20.0 * k, 200.0) for k in range(5)]


def test_both_edges_that_have_settled_stop() -> None:
    decision = Settling()(after_windows(*STEADY))
    assert decision.stop
    assert decision.reason.startswith("The window has settled")


def test_only_the_last_five_values_count() -> None:
    assert Settling()(after_windows((0.0, 500.0), *STEADY)).stop
    assert not Settling(stop_last=6)(after_windows((0.0, 500.0), *STEADY)).stop
    assert looks_back(AnyOf((Budget(9), Settling(stop_last=6)))) == 6


def test_fewer_than_five_windows_do_not_settle() -> None:
    assert not Settling()(after_windows(*STEADY[:4])).stop
    assert not Settling()(after_windows(*STEADY[:4], None)).stop
    assert not Settling()(after_windows(None, *STEADY[:4])).stop


def test_both_edges_must_settle_or_either_where_so_told() -> None:
    assert not Settling()(after_windows(*START_MOVES)).stop
    assert Settling(stop_edges="either")(after_windows(*START_MOVES)).stop
    both_move = [(start, 400.0 - start) for start, _ in START_MOVES]
    assert not Settling(stop_edges="either")(after_windows(*both_move)).stop


def test_the_variance_is_the_samples() -> None:
    # 0, 0, 0, 0, x has the sample variance x²/5 and the population variance 4 x²/25.
    moved = [(100.0, 200.0)] * 4 + [(116.0, 200.0)]
    assert not Settling(stop_variance_ms2=51.1)(after_windows(*moved)).stop
    assert Settling(stop_variance_ms2=51.3)(after_windows(*moved)).stop


@pytest.mark.parametrize(("spread_ms", "stop"), [(25.0, True), (25.1, False)])
def test_particles_that_have_come_together_stop(spread_ms: float, *, stop: bool) -> None:
    estimate = WindowEstimate(None, Window(100.0, 250.0), spread_ms=spread_ms)
    assert Converging()(Progress(30, 30, estimate)).stop == stop


def test_particles_that_were_never_measured_go_on() -> None:
    assert not Converging()(Progress(3, 3, WindowEstimate(None, None, spread_ms=1.0))).stop
    assert not Converging()(Progress(3, 3, WindowEstimate(None, Window(1.0, 2.0)))).stop


@pytest.mark.parametrize(("end_ms", "stop"), [(40.0, True), (45.0, False)])
def test_a_sweep_that_has_left_the_window_behind_stops(end_ms: float, *, stop: bool) -> None:
    estimate = WindowEstimate(None, Window(20.0, end_ms), grid_ms=np.arange(0.0, 66.0, 5.0))
    assert Passing(25.0)(Progress(99, 99, estimate)).stop == stop


def test_a_sweep_without_a_window_goes_on() -> None:
    assert not Passing()(Progress(99, 99, WindowEstimate(None, None, grid_ms=np.arange(9.0)))).stop


@pytest.mark.parametrize(
    ("rule", "settings"),
    [
        (Settling, {"stop_variance_ms2": 0.0}),
        (Settling, {"stop_last": 1}),
        (Settling, {"stop_last": 5.5}),
        (Settling, {"stop_edges": "none"}),
        (Converging, {"stop_sd_ms": 0.0}),
        (Passing, {"quiet_ms": math.nan}),
    ],
)
def test_an_invalid_rule_is_refused(rule: type, settings: dict[str, object]) -> None:
    with pytest.raises(InvalidValueError):
        rule(**settings)
