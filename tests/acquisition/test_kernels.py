import numpy as np
import pytest

from isiw.acquisition.information import MutualInformation, WindowGain
from isiw.types import Array


class Believed:
    """Random predictive distributions, and windows of none, one or two runs; in single or in double precision."""

    trials = 4

    def __init__(self, dtype: type[np.float32 | np.float64]) -> None:
        rng = np.random.default_rng(1)
        mass = rng.random((2, 60, 11, 7)) ** 6
        self.mass: Array = (mass / mass.sum(-1, keepdims=True)).astype(dtype)
        (first, width), isi = rng.integers(-3, 9, (2, 2, 60, 2, 1)), np.arange(11)
        self.masks: Array = ((isi >= first) & (isi < first + width)).any(-2).astype(dtype)

    def estimate(self, person: int = 0) -> None: ...

    def outcome_mass(self, isi_ms: Array) -> Array:
        del isi_ms
        return self.mass

    def window_masks(self, isi_ms: Array) -> Array:
        del isi_ms
        return self.masks


@pytest.mark.parametrize("score", [MutualInformation(), WindowGain()])
def test_scores_of_a_model_in_double_precision_are_those_of_one_in_single(score) -> None:  # type: ignore[no-untyped-def]
    ours, theirs = (score(Believed(dtype), np.arange(11.0)) for dtype in (np.float32, np.float64))
    assert ours.shape == (2, 11)
    np.testing.assert_array_equal(ours, theirs)
