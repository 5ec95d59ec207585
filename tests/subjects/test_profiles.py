"""ISI–MEP response profiles: where they peak, how they fall, and what they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from isiw.errors import InvalidValueError
from isiw.subjects.responses import PeakProfile, TwoPeakProfile

peaks = st.builds(
    PeakProfile, st.floats(-50, 400), st.floats(20, 300), peak_at=st.floats(0.1, 0.9), exponent=st.floats(1, 8)
)


@given(peaks)
def test_a_profile_is_1_at_its_peak_and_exp_minus_2_at_both_ends(profile: PeakProfile) -> None:
    ends = profile([profile.start_ms, profile.start_ms + profile.width_ms])
    np.testing.assert_allclose(ends, math.exp(-2), rtol=1e-6)
    assert profile(profile.start_ms + profile.peak_at * profile.width_ms) == pytest.approx(1.0, abs=1e-9)


@given(peaks, st.floats(-1e3, 1e3))
def test_facilitation_lies_in_0_to_1(profile: PeakProfile, isi_ms: float) -> None:
    assert 0.0 <= float(profile(isi_ms)) <= 1.0


@given(peaks)
def test_a_profile_rises_to_its_peak_and_falls_after_it(profile: PeakProfile) -> None:
    isi_ms = np.linspace(profile.start_ms - 100, profile.start_ms + profile.width_ms + 100, 501)
    before = isi_ms < profile.start_ms + profile.peak_at * profile.width_ms
    steps = np.diff(profile(isi_ms))
    assert (steps[before[1:]] >= 0).all()
    assert (steps[~before[:-1]] <= 0).all()


def test_a_symmetric_profile_of_exponent_2_is_the_gaussian_of_a_quarter_width() -> None:
    isi_ms = np.linspace(0, 200, 41)
    np.testing.assert_allclose(PeakProfile(50, 80)(isi_ms), np.exp(-0.5 * ((isi_ms - 90) / 20) ** 2))


def test_an_exponent_of_8_is_flat_on_top_where_2_is_not() -> None:
    inside = np.linspace(75, 105, 7)
    assert PeakProfile(50, 80, exponent=8)(inside).min() > 0.99
    assert PeakProfile(50, 80)(inside).min() < 0.8


def test_two_peaks_have_the_heights_they_are_given() -> None:
    profile = TwoPeakProfile(100, 100, 1.0, 0.5)
    # Each peak stands on the other one's far flank, which adds at most 0.3 %.
    assert profile([127.0, 173.0]).tolist() == pytest.approx([1.0, 0.5], abs=0.003)
    assert float(profile(150.0)) < 0.4


def test_two_peaks_mirrored_are_the_same_profile_read_backwards() -> None:
    share = np.linspace(-0.5, 1.5, 81)
    early, late = TwoPeakProfile(0, 1, 1.0, 0.6), TwoPeakProfile(0, 1, 0.6, 1.0)
    np.testing.assert_allclose(early(share), late(1 - share), atol=1e-12)


def test_a_profile_keeps_the_shape_of_the_isis() -> None:
    isi_ms = np.zeros((2, 3))
    assert PeakProfile(0, 10)(isi_ms).shape == TwoPeakProfile(0, 10, 1, 1)(isi_ms).shape == (2, 3)


@pytest.mark.parametrize("span", [(math.nan, 10), (math.inf, 10), (0, 0), (0, -1), (0, math.nan), (0, math.inf)])
def test_a_span_that_cannot_be_is_refused(span: tuple[float, float]) -> None:
    with pytest.raises(InvalidValueError, match=r"start_ms|width_ms"):
        PeakProfile(*span)
    with pytest.raises(InvalidValueError, match=r"start_ms|width_ms"):
        TwoPeakProfile(*span, 1.0, 1.0)


@pytest.mark.parametrize(("peak_at", "exponent"), [(0, 2), (1, 2), (math.nan, 2), (0.5, 0), (0.5, math.nan)])
def test_a_peak_outside_its_span_is_refused(peak_at: float, exponent: float) -> None:
    with pytest.raises(InvalidValueError, match=r"peak_at|exponent"):
        PeakProfile(0, 10, peak_at, exponent)


@pytest.mark.parametrize("heights", [(0.5, 0.5), (1, 1.1), (1, -0.1), (1, math.nan), (math.nan, 1)])
def test_the_higher_of_two_peaks_has_height_1(heights: tuple[float, float]) -> None:
    with pytest.raises(InvalidValueError, match=r"height 1|first|second"):
        TwoPeakProfile(0, 10, *heights)
