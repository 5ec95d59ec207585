from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.container import ErrorbarContainer

from isiw.errors import InvalidValueError
from isiw.plots.study import save_study_plot, study_figure
from known import instance


def table(*cohorts: str) -> pd.DataFrame:
    rows = [
        {"cohort": cohort, "strategy": strategy, "trial": trial, "people": 4, "f1": 0.5 + trial / 100, "f1_se": 0.1}
        for cohort in cohorts
        for strategy in ("default", "nr")
        for trial in (10, 20)
    ]
    failed = {"cohort": "wide", "strategy": "pf", "trial": 0, "people": 0}
    return pd.DataFrame([*rows, failed])


def test_each_cohort_has_a_panel_with_a_curve_a_strategy() -> None:
    figure = study_figure(table("wide", "narrow", "drift", "skewed", "plateau"))
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title(loc="left") for axes in shown] == ["wide", "narrow", "drift", "skewed", "plateau"]
    for axes in shown:
        assert [curve.get_label() for curve in axes.containers] == ["default", "nr"]
        curve = instance(ErrorbarContainer, axes.containers[0]).lines[0]
        assert np.asarray(curve.get_ydata()).tolist() == [0.6, 0.7]


def test_a_study_is_drawn_into_a_file_and_an_unknown_format_is_refused(tmp_path: Path) -> None:
    assert save_study_plot(table("wide"), tmp_path / "study.png").stat().st_size > 5000
    with pytest.raises(InvalidValueError, match="format"):
        save_study_plot(table("wide"), tmp_path / "study.xyz")


def test_a_study_without_a_finished_session_has_an_empty_picture() -> None:
    assert len(study_figure(table()).axes) == 1
