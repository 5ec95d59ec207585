import numpy as np
import pytest
import torch

from isiw.models.particles.shapes import TOGETHER, Shape, ShapeKind, facilitation, reaches
from isiw.subjects.responses import PeakProfile, TwoPeakProfile

ISI_MS = np.linspace(-50, 400, 451)


def level(kind: ShapeKind, form: float) -> np.ndarray:
    shape = Shape(torch.tensor([kind]), torch.tensor([40.0]), torch.tensor([100.0]), torch.tensor([form]))
    return facilitation(shape, torch.tensor(ISI_MS, dtype=torch.float32)[None])[0].numpy()


def test_the_gaussian_is_the_cohorts_gaussian_whatever_its_form() -> None:
    expected = PeakProfile(40, 100)(ISI_MS)
    for form in (-0.9, 0.0, 0.9):
        np.testing.assert_allclose(level(ShapeKind.GAUSSIAN, form), expected, atol=1e-5)


@pytest.mark.parametrize("peak_at", [0.22, 0.4, 0.6, 0.78])
def test_every_skew_of_the_cohort_is_in_the_family(peak_at: float) -> None:
    expected = PeakProfile(40, 100, peak_at=peak_at)(ISI_MS)
    np.testing.assert_allclose(level(ShapeKind.SKEWED, (peak_at - 0.5) / 0.33), expected, atol=1e-5)


@pytest.mark.parametrize("exponent", [4.0, 8.0])
def test_every_plateau_of_the_cohort_is_in_the_family(exponent: float) -> None:
    expected = PeakProfile(40, 100, exponent=exponent)(ISI_MS)
    form = np.log(exponent / 2) / 0.75 - 1
    assert -1 <= form <= 1
    np.testing.assert_allclose(level(ShapeKind.PLATEAU, form), expected, atol=1e-4)


@pytest.mark.parametrize(("first", "second"), [(1.0, 0.4), (0.7, 1.0), (1.0, 1.0)])
def test_every_pair_of_peaks_of_the_cohort_is_in_the_family(first: float, second: float) -> None:
    lower = min(first, second)
    form = TOGETHER * (1 - lower) / 0.7 * (1 if second < first else -1)
    np.testing.assert_allclose(
        level(ShapeKind.TWO_PEAK, form), TwoPeakProfile(40, 100, first, second)(ISI_MS), atol=1e-5
    )


@pytest.mark.parametrize("form", [-0.8, 0.77, 0.9])
def test_two_peaks_far_apart_are_two_windows_by_the_rule(form: float) -> None:
    got = level(ShapeKind.TWO_PEAK, form)
    enhanced = got >= 0.135 * got.max()
    assert (np.diff(enhanced.astype(int)) == 1).sum() == 2


@pytest.mark.parametrize("kind", ShapeKind)
def test_a_profile_reaches_a_level_where_its_facilitation_is_at_least_that(kind: ShapeKind) -> None:
    draws = torch.rand((4, 400), generator=torch.Generator().manual_seed(1))
    shape = Shape(torch.full((400,), kind), 300 * draws[0], 20 + 200 * draws[1], 2 * draws[2] - 1)
    isi_ms = torch.tensor(ISI_MS, dtype=torch.float32)
    assert (reaches(shape, draws[3], isi_ms) == (facilitation(shape, isi_ms) >= draws[3, :, None])).all()
    assert not reaches(shape, torch.full((400,), 2.0), isi_ms).any()
