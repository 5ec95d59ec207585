"""Profiles of the engine are those of simulated people, and windows are where they are high enough."""

import numpy as np
import pytest

from isiw.models.particles.records import FORM, PRESENT, SHAPE, START, WIDTH
from isiw.native import engine
from isiw.native.engine import FIELDS
from isiw.subjects.responses import PeakProfile, TwoPeakProfile
from isiw.types import Singles

ISI_MS = np.linspace(-50, 400, 451, dtype=np.float32)
SHAPES = {"gaussian": 0, "skewed": 1, "plateau": 2, "two_peak": 3}
TOGETHER = 0.75
"""Up to which form two peaks are one window."""


def level(kind: str, form: float) -> Singles:
    fields = np.zeros((1, 1, FIELDS), dtype=np.float32)
    for field, value in {SHAPE: SHAPES[kind], PRESENT: 1.0, START: 40.0, WIDTH: 100.0, FORM: form}.items():
        fields[..., field] = value
    found: Singles = engine.facilitations(fields, ISI_MS)[0, 0]
    return found


def test_the_gaussian_is_the_cohorts_gaussian_whatever_its_form() -> None:
    expected = PeakProfile(40, 100)(ISI_MS)
    for form in (-0.9, 0.0, 0.9):
        np.testing.assert_allclose(level("gaussian", form), expected, atol=2e-5)


@pytest.mark.parametrize("peak_at", [0.22, 0.4, 0.6, 0.78])
def test_every_skew_of_the_cohort_is_in_the_family(peak_at: float) -> None:
    expected = PeakProfile(40, 100, peak_at=peak_at)(ISI_MS)
    np.testing.assert_allclose(level("skewed", (peak_at - 0.5) / 0.33), expected, atol=2e-5)


@pytest.mark.parametrize("exponent", [4.0, 8.0])
def test_every_plateau_of_the_cohort_is_in_the_family(exponent: float) -> None:
    expected = PeakProfile(40, 100, exponent=exponent)(ISI_MS)
    form = np.log(exponent / 2) / 0.75 - 1
    assert -1 <= form <= 1
    np.testing.assert_allclose(level("plateau", form), expected, atol=1e-4)


@pytest.mark.parametrize(("first", "second"), [(1.0, 0.4), (0.7, 1.0), (1.0, 1.0)])
def test_every_pair_of_peaks_of_the_cohort_is_in_the_family(first: float, second: float) -> None:
    lower = min(first, second)
    form = TOGETHER * (1 - lower) / 0.7 * (1 if second < first else -1)
    np.testing.assert_allclose(level("two_peak", form), TwoPeakProfile(40, 100, first, second)(ISI_MS), atol=2e-5)


@pytest.mark.parametrize("form", [-0.8, 0.77, 0.9])
def test_two_peaks_far_apart_are_two_windows_by_the_rule(form: float) -> None:
    got = level("two_peak", form)
    enhanced = got >= 0.135 * got.max()
    assert (np.diff(enhanced.astype(int)) == 1).sum() == 2


@pytest.mark.parametrize("kind", SHAPES)
def test_a_window_is_where_a_profiles_facilitation_is_at_least_that_of_its_edge(kind: str) -> None:
    rng = np.random.default_rng(1)
    fields, levels = np.zeros((1, 400, FIELDS), dtype=np.float32), rng.random((1, 400)).astype(np.float32)
    fields[..., SHAPE], fields[..., PRESENT], fields[..., START] = SHAPES[kind], 1.0, 300 * rng.random(400)
    fields[..., WIDTH], fields[..., FORM] = 20 + 200 * rng.random(400), 2 * rng.random(400) - 1
    facilitation = engine.facilitations(fields, ISI_MS)
    within, near = facilitation >= levels[..., np.newaxis], np.abs(facilitation - levels[..., np.newaxis]) < 1e-5
    runs, at = engine.window_runs(fields, levels, ISI_MS), np.arange(len(ISI_MS))
    found = ((runs[..., ::2, np.newaxis] <= at) & (at < runs[..., 1::2, np.newaxis])).any(-2)
    assert ((found == within) | near).all()
    assert not engine.window_runs(fields, np.full((1, 400), 2.0, dtype=np.float32), ISI_MS).any()
