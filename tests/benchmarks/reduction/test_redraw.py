"""The figures of the reproduction are drawn from its committed tables."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.reduction.redraw import redrawn
from matplotlib.figure import Figure

from isiw.plots.style import STRATEGY_COLOURS


@pytest.fixture(scope="module")
def figures() -> dict[str, Figure]:
    return redrawn()


@pytest.mark.slow
def test_no_legend_stands_over_a_panel(figures: dict[str, Figure]) -> None:
    assert set(figures) == {
        "headline_by_trial",
        *(f"trial_reduction_{name}" for name in ("methods", "initial", "particles")),
    }
    for figure in figures.values():
        assert len(figure.legends) == 1
        assert all(axes.get_legend() is None for axes in figure.axes)


def test_a_method_has_the_colour_that_it_has_everywhere(figures: dict[str, Figure]) -> None:
    lines = {str(line.get_label()): line for line in figures["headline_by_trial"].axes[0].lines}
    assert {name: lines[name].get_color() for name in ("NR", "SVMR", "GPR", "default")} == {
        "NR": STRATEGY_COLOURS["nr"], "SVMR": STRATEGY_COLOURS["svmr"], "GPR": STRATEGY_COLOURS["gpr"],
        "default": STRATEGY_COLOURS["default"],
    }  # fmt: skip
    assert np.asarray(lines["default"].get_xdata()).tolist() == [5, 10, 15, 20, 30, 40]
