"""What is reached without stimulating anybody."""

from __future__ import annotations

import numpy as np
from benchmarks.zero_trials import best_fixed, masks_of

from isiw.design import DesignSpace
from isiw.metrics import f1_of_masks
from isiw.window import Window

SPACE = DesignSpace(0, 500, step_ms=25, reference="valve")


def test_no_other_interval_has_a_larger_mean_f1_than_the_fixed_window() -> None:
    masks = masks_of("recruitment", 30, 0, SPACE)
    fixed = best_fixed(masks, SPACE)
    assert fixed is not None
    intervals = [Window(a, b).mask(SPACE.grid_ms) for a in SPACE.grid_ms for b in SPACE.grid_ms[SPACE.grid_ms >= a]]
    means = [f1_of_masks(interval, masks).mean() for interval in intervals]
    assert f1_of_masks(fixed.mask(SPACE.grid_ms), masks).mean() == np.max(means)


def test_where_most_people_have_no_window_the_best_guess_is_none() -> None:
    masks = np.zeros((10, len(SPACE.grid_ms)), dtype=bool)
    masks[:4, 5:9] = True
    assert best_fixed(masks, SPACE) is None
    assert best_fixed(masks[:7], SPACE) == Window(SPACE.grid_ms[5], SPACE.grid_ms[8])
