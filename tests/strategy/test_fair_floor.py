"""What the dissertation's regressions take for the EMG floor where nobody has told them TMS alone."""

from __future__ import annotations

import numpy as np

import isiw
from isiw.models.dissertation.regression import RegressionPosterior


def test_nr_loses_nothing_where_it_asks_inside_the_window_and_tms_alone_was_not_told() -> None:
    space = isiw.DesignSpace(0, 500, reference="valve")
    strategy = isiw.make_strategy("nr", space)
    for isi_ms in np.linspace(205, 295, 31).tolist():  # nearly all inside 200 to 300 ms
        strategy.tell(float(round(isi_ms)), 0.01 + 0.1 * float(np.exp(-0.5 * ((isi_ms - 250) / 25) ** 2)))
    for isi_ms in (0.0, 100.0, 400.0, 500.0):
        strategy.tell(isi_ms, 0.01)
    posterior, window = strategy.posterior, strategy.estimate().window
    assert isinstance(posterior, RegressionPosterior)
    assert posterior.floors_mv[0] < 0.015
    assert window is not None
    assert window.width_ms > 85
