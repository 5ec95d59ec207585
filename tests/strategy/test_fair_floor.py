"""What the dissertation's nonlinear regression takes for the EMG floor where nobody has told it TMS alone."""

from __future__ import annotations

import numpy as np

import isiw
from isiw.dissertation.regression import RegressionPosterior


def test_nr_finds_a_window_that_holds_most_of_its_trials() -> None:
    rng = np.random.default_rng(3)
    strategy = isiw.make_strategy("nr", isiw.DesignSpace(0, 500, reference="valve"))
    asked_ms = rng.permutation([0, 100, 400, 500, *range(205, 296, 3)]).tolist()  # nearly all inside 200 to 300 ms
    for isi_ms in map(float, asked_ms):
        expected_mv = 0.01 + 0.1 * float(np.exp(-0.5 * ((isi_ms - 250) / 25) ** 2))
        strategy.tell(isi_ms, expected_mv * float(rng.uniform(0.9, 1.1)))
    posterior, window = strategy.posterior, strategy.estimate().window
    assert isinstance(posterior, RegressionPosterior)
    assert posterior.floors_mv[0] < 0.02  # 0.01; the median is 0.06
    assert window is not None
    assert 85 < window.width_ms < 120
