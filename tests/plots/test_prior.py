from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from isiw.plots.comparison import prior_figure
from isiw.plots.style import save_figure


@pytest.fixture
def table() -> pd.DataFrame:
    rows = {"value": [1.0, 2.0, 3.0], "built_in": [0.2, 0.5, 0.2], "lab": [0.0, 0.9, 0.0]}
    start = pd.DataFrame({"quantity": "start [ms]", "logarithmic": False, **rows})
    width = pd.DataFrame({"quantity": "width [ms]", "logarithmic": True, **rows})
    return pd.concat([start, width], ignore_index=True)


def test_each_quantity_has_a_panel_with_both_priors_as_they_were_given(table: Any) -> None:
    shown = [axes for axes in prior_figure(table).axes if axes.get_visible()]
    assert [axes.get_title(loc="left") for axes in shown] == ["start [ms]", "width [ms]"]
    assert [axes.get_xscale() for axes in shown] == ["linear", "log"]
    assert np.asarray(shown[0].lines[0].get_ydata()).tolist() == [0.0, 0.9, 0.0]
    assert shown[0].get_legend_handles_labels()[1] == ["built-in", "this lab"]


def test_the_picture_is_written(table: Any, tmp_path: Path) -> None:
    assert save_figure(prior_figure(table), tmp_path / "new" / "p.png").stat().st_size > 3000
