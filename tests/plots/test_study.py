from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes

from isiw.errors import InvalidValueError
from isiw.plots.comparison import study_figure
from isiw.plots.style import STRATEGY_COLOURS, save_figure

OF_A_BELIEF = {"start_coverage": 0.9, "end_coverage": 0.8, "called_none": 0.0}


def table(*cohorts: str, strategies: tuple[str, ...] = ("default", "nr"), **values: Any) -> pd.DataFrame:
    rows = [
        {
            "cohort": cohort, "strategy": strategy, "trial": trial, "people": 4, "f1": 0.5 + trial / 100,
            "f1_low": 0.3 + trial / 100, "f1_high": 0.7 + trial / 100, "delivered": trial + 1.0,
            "end_delivered": 15.0, "end_f1": 0.65, "ask_ms": 3.0, "tell_ms": 1.0,
        } | OF_A_BELIEF | values
        for cohort in cohorts
        for strategy in strategies
        for trial in (0, 10, 20)
    ]  # fmt: skip
    failed = {"cohort": "wide", "strategy": "pf", "trial": 0, "people": 0}
    return pd.DataFrame([*rows, failed])


def curve(axes: Axes, label: str) -> tuple[list[float], list[float]]:
    (line,) = [line for line in axes.lines if line.get_label() == label]
    return np.asarray(line.get_xdata()).tolist(), np.asarray(line.get_ydata()).tolist()


def test_each_cohort_has_a_panel_with_a_curve_and_a_band_a_strategy() -> None:
    figure = study_figure(table("wide", "narrow", "drift", "skewed", "plateau"))
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title(loc="left") for axes in shown] == ["wide", "narrow", "drift", "skewed", "plateau"]
    for axes in shown:
        for name in ("default", "nr"):
            assert curve(axes, name) == ([0, 10, 20], [0.5, 0.6, 0.7])
        (band, _) = axes.collections
        heights = np.asarray(band.get_paths()[0].vertices)[:, 1]
        assert (heights.min(), heights.max()) == pytest.approx((0.3, 0.9))


def test_without_the_ends_of_the_band_the_standard_error_gives_them_within_0_and_1() -> None:
    rows = table("wide", strategies=("default",), f1_se=0.2).drop(columns=["f1_low", "f1_high"])
    (band, *_) = study_figure(rows).axes[0].collections
    heights = np.asarray(band.get_paths()[0].vertices)[:, 1]
    assert (heights.min(), heights.max()) == pytest.approx((0.5 - 0.392, 1.0))


def test_a_strategy_has_its_colour_whatever_it_is_compared_with() -> None:
    for strategies in (("default",), ("default", "nr", "gpr", "mine")):
        axes = study_figure(table("wide", strategies=strategies), "frontier").axes[0]
        colours = {str(line.get_label()): line.get_color() for line in axes.lines}
        assert colours["default"] == STRATEGY_COLOURS["default"]
    assert len({colours[name] for name in strategies}) == 4


@pytest.mark.slow
def test_of_more_than_three_strategies_each_has_a_panel_with_its_band_before_the_means_of_the_others() -> None:
    figure = study_figure(table("wide", "narrow", strategies=("default", "nr", "gpr", "mine")))
    shown = [axes for axes in figure.axes if axes.get_visible()]
    names = [start + name for start in ("wide: ", "narrow: ") for name in ("default", "gpr", "mine", "nr")]
    names = [name if name.endswith("default") else name.partition(": ")[2] for name in names]
    assert [axes.get_title(loc="left") for axes in shown] == names
    for axes in shown:
        assert len(axes.collections) == 1
        assert sum(line.get_label() == "the other strategies" for line in axes.lines) == 3


def test_a_method_without_a_belief_is_not_drawn_before_it_has_reported_a_window() -> None:
    late = table("wide", strategies=("pf",), start_coverage=math.nan, end_coverage=math.nan)
    late.loc[late["trial"] < 20, ["called_none", "f1"]] = [1.0, 0.0]
    assert curve(study_figure(late).axes[0], "pf") == ([20], [0.7])
    assert curve(study_figure(late, "frontier").axes[0], "pf") == ([21], [0.7])
    assert study_figure(late, "coverage").axes[0].texts[0].get_text() == "no true edges, or no intervals"
    late[["called_none"]] = 1.0
    assert curve(study_figure(late).axes[0], "pf")[0] == [0, 10, 20]


def test_what_is_believed_before_any_trial_is_a_dotted_line() -> None:
    axes = study_figure(table("wide", strategies=("default",))).axes[0]
    assert [np.asarray(line.get_ydata()).tolist() for line in axes.lines if line.get_linestyle() == ":"] == [[0.5, 0.5]]


def test_the_frontier_is_the_f1_that_is_kept_by_stimuli_delivered() -> None:
    rows = table("wide", strategies=("default",))
    rows.loc[rows["trial"] == 10, "f1"] = 0.9
    axes = study_figure(rows, "frontier").axes[0]
    assert curve(axes, "default") == ([1, 11, 21], [0.5, 0.7, 0.7])
    stops = [(line.get_xdata(), line.get_ydata()) for line in axes.lines if line.get_marker() == "o"]
    assert [(np.asarray(x).tolist(), np.asarray(y).tolist()) for x, y in stops] == [([15.0], [0.65]), ([], [])]


def test_coverage_has_both_edges_and_leaves_out_methods_without_intervals() -> None:
    rows = table("wide")
    rows.loc[rows["strategy"] == "nr", ["start_coverage", "end_coverage"]] = math.nan
    figure = study_figure(rows, "coverage")
    heights = [np.asarray(line.get_ydata()).tolist() for line in figure.axes[0].lines]
    assert [0.9] * 3 in heights
    assert [0.8] * 3 in heights
    said = {text.get_text() for text in figure.legends[0].get_texts()}
    assert said == {"what 90 % intervals should have", "start", "end", "default"}


def test_a_picture_as_vector_graphics_is_the_same_each_time(tmp_path: Path) -> None:
    first, second = (save_figure(study_figure(table("wide")), tmp_path / f"{k}.svg").read_bytes() for k in range(2))
    assert first == second
    assert b"<svg" in first


def test_vector_graphics_are_dark_in_a_dark_viewer_and_so_are_those_of_the_first_page(tmp_path: Path) -> None:
    made = save_figure(study_figure(table("wide")), tmp_path / "study.svg").read_text("utf-8")
    images = Path(__file__).parents[2] / "docs" / "images"
    for drawn in (made, *((images / f"{name}.svg").read_text("utf-8") for name in ("session", "results"))):
        (dark,) = re.findall(r"<style>@media \(prefers-color-scheme: dark\) (.*?)</style>", drawn)
        assert '[style*="fill: #ffffff"] { fill: #15181b !important }' in dark


def test_latency_has_the_times_of_ask_and_tell() -> None:
    axes = study_figure(table("wide", strategies=("default",)), "latency").axes[0]
    assert axes.get_yscale() == "log"
    heights = [np.asarray(line.get_ydata()).tolist() for line in axes.lines if len(np.asarray(line.get_ydata()))]
    assert heights == [[3.0] * 3, [1.0] * 3]


def test_an_unknown_picture_is_refused() -> None:
    unknown: Any = "pie"
    with pytest.raises(InvalidValueError, match="frontier"):
        study_figure(table("wide"), unknown)


def test_a_study_without_a_finished_session_has_an_empty_picture() -> None:
    assert len(study_figure(table()).axes) == 1
